// Speeds as they are typed and shown.
import { expect, test } from "vitest";
import { readFactor, shownFactor } from "./factor";

test("a speed has as many digits as are worth reading", () => {
  expect([0.1, 1, 12.34, 250.4, Infinity].map(shownFactor)).toEqual(["0.10x", "1.00x", "12.3x", "250x", "max"]);
});

test("a speed may be typed with its x and with a comma", () => {
  expect(["0.25", " 2x ", "0,5", "max", "10 X"].map(readFactor)).toEqual([0.25, 2, 0.5, Infinity, 10]);
});

test("an invalid factor gives a message", () => {
  for (const text of ["", "fast", "0", "-1", "5000", "1e9"]) expect(typeof readFactor(text), text).toBe("string");
});
