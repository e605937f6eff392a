// Source of a recording's bytes: the daemon, in parts, or a file that was dropped on the page.
import { Code, ConnectError } from "@connectrpc/connect";
import type { Services } from "../daemon/services";

/** Data that cannot be read on any attempt. Other failures are temporary, such as a lost connection. */
export class Damage extends Error {}

/** Maximum bytes of one read. */
export const MAX_READ = 32 << 20;

/** A file that is read in parts. */
export interface Source {
  /** Its name without a folder. */
  name: string;
  /** Bytes. */
  size: number;
  /** Returns exactly these bytes; rejects with `Damage` if it has fewer, or if they are too many. */
  read(offset: number, length: number): Promise<Uint8Array>;
}

/** A file of this browser. */
export function fileSource(file: Blob & { name: string }): Source {
  return {
    name: file.name,
    size: file.size,
    async read(offset, length) {
      check(offset, length, file.size);
      try {
        return new Uint8Array(await file.slice(offset, offset + length).arrayBuffer());
      } catch {
        throw new Damage(`${file.name} cannot be read: was it moved, or changed since it was opened?`);
      }
    },
  };
}

/** A file of a recording of the daemon, with the length that it had at the request. */
export function daemonSource(recordings: Services["recordings"], name: string, file: string, size: number): Source {
  return {
    name: file,
    size,
    async read(offset, length) {
      check(offset, length, size);
      const bytes = new Uint8Array(length);
      for (let done = 0; done < length; ) {
        const part = await recordings.readRecording({ name, file, offset: BigInt(offset + done), maxBytes: BigInt(length - done) }).catch((error: unknown) => {
          throw error instanceof ConnectError && error.code === Code.NotFound ? new Damage(`${file} is no longer on the daemon's disk`) : error;
        });
        if (part.data.length === 0 || part.data.length > length - done) throw new Damage(`${file} has changed on the daemon's disk`);
        bytes.set(part.data, done);
        done += part.data.length;
      }
      return bytes;
    },
  };
}

function check(offset: number, length: number, size: number): void {
  if (length > MAX_READ) throw new Damage(`a part of ${length} bytes is larger than anything in a recording`);
  if (offset < 0 || length < 0 || offset + length > size) throw new Damage("it ends before it is complete");
}
