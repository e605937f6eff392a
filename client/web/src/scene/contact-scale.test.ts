// The scale of forces has round numbers.
import { expect, test } from "vitest";
import { roundBelow } from "./contact-scale";

test("a force is rounded down to 1, 2 or 5 times a power of ten", () => {
  const cases = [[0.0199, 0.01], [1, 1], [1.99, 1], [2, 2], [4.99, 2], [5, 5], [9.9, 5], [123, 100], [777, 500]] as const;
  for (const [value, round] of cases) expect(roundBelow(value)).toBeCloseTo(round, 12);
});
