// The newest call is made, one at a time; older waiting calls are dropped.
import { expect, test, vi } from "vitest";
import { Throttle } from "./throttle";

test("the first and the last of many calls are made, and the last after the interval", async () => {
  vi.useFakeTimers();
  try {
    const throttle = new Throttle(50);
    const made: [number, number][] = [];
    const began = Date.now();
    for (let index = 0; index < 10; index += 1) {
      void throttle.next(() => {
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
    void throttle.next(() => {
      made.push("slow");
      return new Promise<void>((resolve) => (finish = resolve));
    });
    void throttle.next(() => Promise.resolve(void made.push("next")));
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

test("the last call of a series is made though later calls and the end come before it", async () => {
  vi.useFakeTimers();
  try {
    const throttle = new Throttle(10);
    const made: string[] = [];
    const call = (name: string) => () => Promise.resolve(void made.push(name));
    void throttle.next(call("first"));
    void throttle.next(call("replaced"));
    const done = throttle.finish(call("last"));
    void throttle.next(call("of another series"));
    throttle.end();
    await vi.advanceTimersByTimeAsync(100);
    await done;
    expect(made).toEqual(["first", "last"]);
  } finally {
    vi.useRealTimers();
  }
});
