// Samples that a recording keeps, and those that it drops.
import { expect, test } from "vitest";
import { Samples } from "./samples";

function recorded(seconds: number, rate: number, span = 60, most = 40_000): Samples {
  const samples = new Samples(span, most, 16);
  samples.add("a");
  for (let step = 0; step <= seconds * rate; step += 1) samples.push(step / rate, () => step);
  return samples;
}

test("the last span is kept, with each value next to its time", () => {
  const samples = recorded(100, 60);
  expect(samples.last).toBe(100);
  expect(samples.times()[0]).toBeCloseTo(40, 9);
  expect(samples.length).toBe(3601);
  expect(samples.column("a")[0]).toBe(2400);
  expect(samples.column("a").at(-1)).toBe(6000);
});

test("memory stays bounded however slowly time passes", () => {
  const samples = recorded(10, 1000, 60, 500);
  expect(samples.length).toBe(500);
  expect(samples.column("a").at(-1)).toBe(10_000);
});

test("an earlier time clears the recording", () => {
  const samples = recorded(1, 10);
  samples.push(0.5, () => 7);
  expect([...samples.times()]).toEqual([0.5]);
  expect([...samples.column("a")]).toEqual([7]);
});

test("while time stands the newest sample is replaced", () => {
  const samples = recorded(1, 10);
  const length = samples.length;
  samples.push(1, () => 99);
  expect(samples.length).toBe(length);
  expect(samples.column("a").at(-1)).toBe(99);
});

test("a column that comes later has no values before", () => {
  const samples = recorded(1, 10);
  samples.add("b");
  samples.push(1.1, (name) => (name === "b" ? 5 : 6));
  expect(samples.column("b")).toHaveLength(12);
  expect(samples.column("b")[0]).toBeNaN();
  expect(samples.column("b").at(-1)).toBe(5);
  for (let step = 0; step < 100; step += 1) samples.push(2 + step, () => step);
  expect(samples.column("b").every((value) => !Number.isNaN(value))).toBe(true);
});

test("a copy stays unchanged", () => {
  const samples = recorded(1, 10);
  const copy = samples.copy();
  samples.push(5, () => 1);
  samples.clear();
  expect(copy.length).toBe(11);
  expect(copy.column("a").at(-1)).toBe(10);
});
