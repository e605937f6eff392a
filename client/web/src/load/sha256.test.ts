// Files have the daemon's hash, even on pages where browsers offer no SHA-256.
import { createHash } from "node:crypto";
import { afterEach, expect, test, vi } from "vitest";
import { sha256 } from "./sha256";

afterEach(() => vi.unstubAllGlobals());

for (const secure of [true, false]) {
  test(`bytes have the hash that the system computes, on a page ${secure ? "with" : "without"} the browser's own`, async () => {
    if (!secure) vi.stubGlobal("crypto", {});
    const long = Uint8Array.from({ length: 1000 }, (_, index) => (index * 73) % 256);
    // The last is in the middle of its buffer.
    for (const bytes of [long.slice(0, 0), long.slice(0, 64), long, long.subarray(3, 700)]) {
      expect(await sha256(bytes)).toBe(createHash("sha256").update(bytes).digest("hex"));
    }
  });
}
