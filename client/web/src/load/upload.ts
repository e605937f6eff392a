// Sends a file to the daemon, in parts.
import type { Services } from "../daemon/services";

/** Bytes of a file in one message: well below the limit of the daemon, and enough to make round trips negligible. */
const PART_BYTES = 1024 * 1024;

/** Sends a file under its SHA-256. Before each part, `progress` is called with the number of sent bytes. */
export async function uploadFile(entities: Services["entities"], hash: string, bytes: Uint8Array<ArrayBuffer>, progress: (sent: number) => void = () => undefined): Promise<void> {
  for (let offset = 0; offset === 0 || offset < bytes.length; offset += PART_BYTES) {
    progress(offset);
    const data = bytes.subarray(offset, offset + PART_BYTES);
    await entities.uploadAsset({ sha256: hash, totalBytes: BigInt(bytes.length), offset: BigInt(offset), data });
  }
}
