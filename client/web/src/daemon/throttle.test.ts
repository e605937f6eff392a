// The newest call is made, one at a time; older waiting calls are dropped.
import { expect, test, vi } from "vitest";
import { Throttle } from "./throttle";

test("of many calls the first and the last are made, and the last after the interval", async () => {
  vi.useFakeTimers();
  try {
    const throttle = new Throttle(50);
    const made: [number, number][] = [];
    const began = Date.now();
    for (let index = 0; index < 10; index += 1) {
      throttle.next(() => {
        made.push([index, Date.now() - began]);
        return Promise.resolve();
      });
    }
    await vi.advanceTimersByTimeAsync(200);
    expect(made).toEqual([
      [0, 0],
      [9, 50],
    ]);
  } finally {
    vi.useRealTimers();
  }
});

test("a call waits for the one before, and none is made after the end", async () => {
  vi.useFakeTimers();
  try {
    const throttle = new Throttle(10);
    let finish = (): void => undefined;
    const made: string[] = [];
    throttle.next(() => {
      made.push("slow");
      return new Promise<void>((resolve) => (finish = resolve));
    });
    throttle.next(() => Promise.resolve(void made.push("next")));
    await vi.advanceTimersByTimeAsync(100);
    expect(made).toEqual(["slow"]);
    throttle.end();
    finish();
    await vi.advanceTimersByTimeAsync(100);
    expect(made).toEqual(["slow"]);
  } finally {
    vi.useRealTimers();
  }
});
