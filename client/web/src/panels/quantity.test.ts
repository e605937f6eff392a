// Texts that people may type into a number box, and texts that it shows.
import { expect, test } from "vitest";
import { digits, parse, shortened, threeDigits, unitOf } from "./quantity";

const rad = unitOf("angle", "position", false);
const deg = unitOf("angle", "position", true);
const metre = unitOf("length", "position", true);

test("a number without a unit is in the unit that is shown", () => {
  expect(parse("0.5", "angle", "position", rad)).toBe(0.5);
  expect(parse("90", "angle", "position", deg)).toBeCloseTo(Math.PI / 2, 12);
  expect(parse("0.5", "length", "position", metre)).toBe(0.5);
});

test("a typed unit counts, whatever unit is shown", () => {
  for (const [text, value] of [
    ["90 deg", Math.PI / 2],
    ["90°", Math.PI / 2],
    ["-45deg", -Math.PI / 4],
    ["0.2 rad", 0.2],
    ["200 mrad", 0.2],
    [".25 turn", Math.PI / 2],
    ["1e-1 RAD", 0.1],
    ["0,2 rad", 0.2],
    ["−1 rad", -1],
  ] as const) {
    expect(parse(text, "angle", "position", rad), text).toBeCloseTo(value, 12);
    expect(parse(text, "angle", "position", deg), text).toBeCloseTo(value, 12);
  }
  expect(parse("5 cm", "length", "position", metre)).toBeCloseTo(0.05, 12);
  expect(parse("100 mm", "length", "position", metre)).toBeCloseTo(0.1, 12);
  expect(parse("30 rpm", "angle", "velocity", rad)).toBeCloseTo(Math.PI, 12);
  expect(parse("90 deg/s", "angle", "velocity", rad)).toBeCloseTo(Math.PI / 2, 12);
  expect(parse("2 N m", "angle", "effort", rad)).toBe(2);
  expect(parse("2 nm", "angle", "effort", rad)).toBe(2);
  expect(parse("3N", "length", "effort", metre)).toBe(3);
});

test("parts of pi are radians, even if degrees are shown", () => {
  for (const [text, value] of [
    ["pi", Math.PI],
    ["-pi/2", -Math.PI / 2],
    ["2pi/3", (2 * Math.PI) / 3],
    ["0.5 * π", Math.PI / 2],
    ["pi/4 rad", Math.PI / 4],
  ] as const) {
    expect(parse(text, "angle", "position", deg), text).toBeCloseTo(value, 12);
  }
});

test("sums, products and parentheses are computed, with units after products", () => {
  for (const [text, value] of [
    ["2*0.3", 0.6],
    ["-2 * 0.3 rad", -0.6],
    ["2*pi/3", (2 * Math.PI) / 3],
    ["1/4", 0.25],
    ["3*30 deg", Math.PI / 2],
    ["pi*2", 2 * Math.PI],
    ["0.5+0.1", 0.6],
    ["1 - 2 - 3", -4],
    ["2*(0.1 + 0.2)", 0.6],
    ["(pi - 1)/2", (Math.PI - 1) / 2],
    ["2(1 + 1)", 4],
    ["90 deg + 0.1 rad", Math.PI / 2 + 0.1],
    ["pi/2 - 45 deg", Math.PI / 4],
    ["(20 + 10) deg", Math.PI / 6],
    ["90 deg / 2", Math.PI / 4],
    ["1/4 turn", Math.PI / 2],
    ["2*-0.3", -0.6],
    ["-(1 − 3)", 2],
  ] as const) {
    expect(parse(text, "angle", "position", rad), text).toBeCloseTo(value, 12);
  }
});

test("errors quote the text as it was typed", () => {
  expect(parse("2*0.3 foo", "angle", "position", rad)).toContain('"foo" in "2*0.3 foo"');
  expect(parse("2**3", "angle", "position", rad)).toContain('"2**3" is not a number');
  expect(parse("0.5+", "angle", "position", rad)).toContain('"0.5+" is not a number');
  expect(parse("(1", "angle", "position", rad)).toContain('"(1" is not a number');
  expect(parse("2 deg rad", "angle", "position", rad)).toContain('"2 deg rad" is not a number');
  expect(parse("1.2.3", "angle", "position", rad)).toContain('"1.2.3" is not a number');
});

test("a sum of numbers with and without a unit is not guessed at", () => {
  expect(parse("90 deg + 0.1", "angle", "position", rad)).toMatch(/"90 deg \+ 0.1" adds .* write the unit at each/);
  expect(parse("1 + 2 cm", "length", "position", metre)).toMatch(/write the unit at each/);
});

test("no text takes long or deep to refuse", () => {
  expect(typeof parse("(".repeat(150), "angle", "position", rad)).toBe("string");
  expect(typeof parse("1+".repeat(100_000), "angle", "position", rad)).toBe("string");
});

test("an invalid unit gives a message with valid ones", () => {
  expect(parse("5 kg", "angle", "position", rad)).toMatch(/"kg" in "5 kg" does not fit here.*rad, deg/);
  expect(parse("5 deg", "length", "position", metre)).toMatch(/"deg" in "5 deg" does not fit.*m, cm, mm/);
  expect(parse("5 rad", "angle", "velocity", rad)).toMatch(/"rad" in "5 rad" does not fit.*rad\/s/);
  for (const text of ["", "abc", "deg", "--1", "1/0"]) expect(typeof parse(text, "angle", "position", rad), text).toBe("string");
});

test("shown numbers have fixed places, and no negative zero", () => {
  expect(digits(-0.0001, rad)).toBe("0.000");
  expect(digits(Math.PI / 2, deg)).toBe("90.00");
  expect(digits(0.5, rad)).toBe("0.500");
  expect(digits(NaN, rad)).toBe("–");
});

test("formatted values parse to themselves", () => {
  for (const unit of [rad, deg]) {
    const value = parse(digits(1.234, unit), "angle", "position", unit);
    expect(value).toBeCloseTo(1.234, 3);
  }
});

test("three digits count if there are no fixed places", () => {
  expect([4.2134, 0.12345, 1234.5, NaN].map(shortened)).toEqual(["4.21", "0.123", "1230", "–"]);
});

test("forces have three significant digits, even if the last is zero", () => {
  expect([4.912, 4.9, 0.05, 9.996, 49.04, 12345, 0].map(threeDigits)).toEqual(["4.91", "4.90", "0.0500", "10.0", "49.0", "12300", "0.00"]);
});
