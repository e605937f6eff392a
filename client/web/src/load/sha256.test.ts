// The fallback gives the digests of the standard, and of Node's own library, at every length of a block.
import { createHash } from "node:crypto";
import { expect, test } from "vitest";
import { digestOf, sha256 } from "./sha256";

const hex = (bytes: Uint8Array) => Buffer.from(bytes).toString("hex");

test("the examples of FIPS 180-4 have their digests", () => {
  const digest = (text: string) => hex(digestOf(new TextEncoder().encode(text)));
  expect(digest("abc")).toBe("ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  expect(digest("")).toBe("e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
});

test("bytes of any length have the digest that the system computes", async () => {
  const long = Uint8Array.from({ length: 1000 }, (_, index) => (index * 73) % 256);
  for (const length of [1, 54, 55, 56, 57, 63, 64, 65, 119, 120, 128, 1000]) {
    const bytes = long.slice(0, length);
    const expected = createHash("sha256").update(bytes).digest("hex");
    expect(hex(digestOf(bytes)), String(length)).toBe(expected);
    expect(await sha256(bytes), String(length)).toBe(expected);
  }
});

test("bytes in the middle of a buffer are taken from there", () => {
  const bytes = new TextEncoder().encode("xxabc").subarray(2);
  expect(hex(digestOf(bytes))).toBe("ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
});
