// Frames of LZ4, from another implementation, and damaged.
import { compress } from "lz4js";
import { expect, test } from "vitest";
import { decompress } from "./lz4";

function frame(data: Uint8Array): Uint8Array {
  return new Uint8Array(compress(data));
}

/** Numbers that look random and are the same each time (xorshift, Marsaglia, 2003). */
function numbers(count: number, most: number): Uint8Array {
  let state = 2463534242;
  return Uint8Array.from({ length: count }, () => {
    state ^= state << 13;
    state ^= state >>> 17;
    state ^= state << 5;
    return (state >>> 0) % most;
  });
}

test.each([
  ["nothing", new Uint8Array(0)],
  ["a run", new Uint8Array(100_000).fill(7)],
  ["a long run of a pattern", Uint8Array.from({ length: 300_000 }, (_, at) => at % 3)],
  ["what can hardly be compressed", numbers(1_000_000, 256)],
  ["some of both", numbers(200_000, 3)],
])("%s comes back as it was", (_, data) => {
  expect(Buffer.compare(decompress(frame(data), data.length), data)).toBe(0);
});

test("a frame that is cut anywhere, or is of another length, is refused", () => {
  const data = numbers(2000, 5);
  const whole = frame(data);
  for (let length = 0; length < whole.length; length += 1) expect(() => decompress(whole.subarray(0, length), data.length)).toThrow("damaged");
  expect(() => decompress(whole, data.length + 1)).toThrow("damaged");
  expect(() => decompress(whole, data.length - 1)).toThrow("damaged");
  expect(() => decompress(whole, 0)).toThrow("damaged");
});

test("a flipped bit is refused, or gives other bytes of the same length", () => {
  const data = numbers(500, 4);
  const whole = frame(data);
  for (let bit = 0; bit < 8 * whole.length; bit += 1) {
    const flipped = whole.slice();
    flipped[bit >> 3] = (flipped[bit >> 3] ?? 0) ^ (1 << (bit & 7));
    try {
      expect(decompress(flipped, data.length).length).toBe(data.length);
    } catch (error) {
      expect(String(error)).toContain("damaged");
    }
  }
});

test("a match before the beginning is refused", () => {
  // A frame of one block: no literals, and a match 5 bytes before nothing.
  const bytes = [0x04, 0x22, 0x4d, 0x18, 0x40, 0x40, 0, 3, 0, 0, 0, 0x00, 5, 0, 0, 0, 0, 0];
  expect(() => decompress(Uint8Array.from(bytes), 4)).toThrow("damaged");
});
