// Measurements of sensors in words.
import { expect, test } from "vitest";
import { words } from "./sensor-words";

test("a range is a distance, out of reach, too near, or lost", () => {
  const said = [1.5, Infinity, -Infinity, NaN].map((range) => words({ kind: "range", range }));
  expect(said).toEqual(["1.5 m", "nothing in reach", "too near", "lost"]);
});

test("a scan in which nothing is hit says so", () => {
  expect(words({ kind: "lidar", rays: 3, hits: 0, nearest: Infinity, ranges: [Infinity, NaN, -Infinity] })).toBe("nothing in reach of 3 rays");
  expect(words({ kind: "lidar", rays: 3, hits: 2, nearest: 0.25, ranges: [0.25, 2, Infinity] })).toBe("2 of 3 rays, nearest 0.25 m");
});
