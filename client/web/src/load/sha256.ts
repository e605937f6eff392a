// SHA-256 of files, which the daemon knows them by.
import { sha256 as digestOf } from "@noble/hashes/sha2.js";
import { bytesToHex } from "@noble/hashes/utils.js";

/**
 * Lower-case hexadecimal. Browsers have SHA-256, off the main thread, on pages that came by https or from this
 * machine alone; the package serves all others, at about a seventh of the speed.
 */
export async function sha256(bytes: Uint8Array<ArrayBuffer>): Promise<string> {
  // TypeScript does not know that it may be absent.
  const subtle = globalThis.crypto.subtle as SubtleCrypto | undefined;
  return bytesToHex(subtle ? new Uint8Array(await subtle.digest("SHA-256", bytes)) : digestOf(bytes));
}
