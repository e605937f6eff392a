// Slow pictures count, and pauses do not.
import { expect, test } from "vitest";
import { FrameTimes } from "./frame-times";

function after(interval: (n: number) => number, drew: (n: number) => boolean = () => true): FrameTimes {
  const times = new FrameTimes();
  let at = 0;
  for (let n = 0; n < 100; n += 1) {
    at += interval(n);
    times.take(at, drew(n), true);
  }
  return times;
}

test("pictures are slow when most of them take long, and not for a few", () => {
  expect(after(() => 16).isSlow()).toBe(false);
  expect(after(() => 60).isSlow()).toBe(true);
  expect(after((n) => (n % 4 === 0 ? 300 : 16)).isSlow()).toBe(false);
});

test("frames that draw nothing, pauses and a hidden tab say nothing", () => {
  expect(after(() => 60, (n) => n % 2 === 0).isSlow()).toBe(false);
  expect(after(() => 5000).isSlow()).toBe(false);
  const times = new FrameTimes();
  // One picture each second, none of which requests the next.
  for (let at = 0; at < 60_000; at += 1000) times.take(at, true, false);
  expect(times.isSlow()).toBe(false);
});

test("more is drawn if most pictures come fast, and less if they no longer do", () => {
  expect([after(() => 16).isFast(), after(() => 16).isLate()]).toEqual([true, false]);
  expect([after((n) => (n % 4 === 0 ? 300 : 16)).isFast(), after(() => 22).isFast(), after(() => 22).isLate()]).toEqual([true, false, false]);
  expect([after(() => 33).isFast(), after(() => 33).isLate(), after(() => 33).isSlow()]).toEqual([false, true, false]);
  const few = new FrameTimes();
  expect([few.isFast(), few.isLate()]).toEqual([false, false]);
});

test("slow pictures are forgotten", () => {
  const times = after(() => 60);
  times.forget();
  expect(times.isSlow()).toBe(false);
});
