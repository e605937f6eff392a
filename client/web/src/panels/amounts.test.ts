// Sizes and times in words.
import { expect, test } from "vitest";
import { bytesText, durationText } from "./amounts";

test("sizes have three digits at most", () => {
  expect([0, 1234, 999_400, 999_600, 1_234_567, 123_456_789, 5e9, 7e15].map(bytesText)).toEqual(["0 kB", "1 kB", "999 kB", "1.0 MB", "1.2 MB", "123 MB", "5.0 GB", "7000 TB"]);
});

test("times are those of a clock", () => {
  expect([0, 12.9, 725, 3725, -3].map(durationText)).toEqual(["0:00", "0:12", "12:05", "1:02:05", "0:00"]);
});
