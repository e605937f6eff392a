// SHA-256 of files, by which the daemon knows them.
import { sha256 as digestOf } from "@noble/hashes/sha2.js";
import { bytesToHex } from "@noble/hashes/utils.js";

/**
 * Returns the SHA-256 digest in lower-case hexadecimal. Browsers compute it off the main thread, but only on
 * pages from https or from this machine. The package serves all other pages at about a seventh of the speed.
 */
export async function sha256(bytes: Uint8Array<ArrayBuffer>): Promise<string> {
  // TypeScript does not know that it may be absent.
  const subtle = globalThis.crypto.subtle as SubtleCrypto | undefined;
  return bytesToHex(subtle ? new Uint8Array(await subtle.digest("SHA-256", bytes)) : digestOf(bytes));
}
