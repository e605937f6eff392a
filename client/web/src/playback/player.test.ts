// Playback of a recording whose states are read with delays and failures.
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import type { RecordedState, Timeline } from "../recording/timeline";
import { Player } from "./player";

let isLost = false;

/** A hundred states, which are read one by one; after a failure, the next is read a second later, as in a timeline. */
const timeline = {
  count: 100,
  period: 0.01,
  problems: new Set<string>(),
  isReady: () => false,
  async state(number: number): Promise<RecordedState> {
    if (isLost) {
      await new Promise((resolve) => setTimeout(resolve, 1000));
      throw new TypeError("Failed to fetch");
    }
    return { number, simTime: number / 100, poses: new Map(), joints: new Map() };
  },
} as unknown as Timeline;

beforeEach(() => {
  vi.useFakeTimers();
  isLost = false;
});
afterEach(() => vi.useRealTimers());

test("a state that cannot be had is waited for, and shown when the daemon is back", async () => {
  const player = new Player(timeline, "run");
  await vi.advanceTimersByTimeAsync(1);
  expect([player.shown.value?.number, player.waiting.value]).toEqual([0, false]);
  isLost = true;
  player.seek(50);
  await vi.advanceTimersByTimeAsync(3500);
  expect([player.shown.value?.number, player.waiting.value]).toEqual([0, true]);
  // A newer request replaces the waiting one.
  player.seek(60);
  isLost = false;
  await vi.advanceTimersByTimeAsync(2000);
  expect([player.shown.value?.number, player.waiting.value]).toEqual([60, false]);
  player.seek(70);
  await vi.advanceTimersByTimeAsync(1);
  expect(player.shown.value?.number).toBe(70);
});
