// A page over a world without motion is idle.

import type { CDPSession } from "playwright-core";
import { expect, test } from "vitest";

import { Tab } from "./browser";
import { Daemon } from "./daemon";
import { fixtures } from "./fixtures";

const use = fixtures();

/**
 * Counts since the page was loaded, and since the session measures; `busy` is seconds that its main thread computed, `at` seconds of the
 * clock.
 */
async function counts(tab: Tab, session: CDPSession): Promise<{ pictures: number; frames: number; busy: number; at: number }> {
  const { metrics } = await session.send("Performance.getMetrics");
  const metric = (name: string): number => metrics.find((one) => one.name === name)?.value ?? Number.NaN;
  const { pictures, frames } = await tab.page.evaluate(() => ({ pictures: window.simd.stats.pictures(), frames: window.simd.stats.frames() }));
  return { pictures, frames, busy: metric("ThreadTime"), at: metric("Timestamp") };
}

test("a world that plays and in which nothing moves is not drawn again, and asked for little", async () => {
  const daemon = await use.daemon(Daemon.demo());
  const tab = await Tab.open(await use.context(), daemon.url);
  const session = await tab.page.context().newCDPSession(tab.page);
  await session.send("Performance.enable");
  // Waits until the arm hangs still in its actuators.
  const rests = async (): Promise<boolean> => {
    const { pictures } = await counts(tab, session);
    await daemon.pass(1);
    return (await counts(tab, session)).pictures === pictures;
  };
  await expect.poll(rests).toBe(true);
  const before = await counts(tab, session);
  await daemon.pass(2);
  const after = await counts(tab, session);
  const seconds = after.at - before.at;
  const share = (after.busy - before.busy) / seconds;
  console.log(`a still world: ${((after.frames - before.frames) / seconds).toFixed(1)} states/s, ${(100 * share).toFixed(1)} % of a core on the main thread`);
  expect(after.pictures).toBe(before.pictures);
  expect((after.frames - before.frames) / seconds).toBeLessThan(12);
  // Time advances, and motion is seen.
  expect(await tab.page.getByTestId("sim-time").textContent()).not.toBe("–");
  await daemon.aim("bench_arm", { shoulder: 0.6 });
  await tab.page.waitForFunction(() => Math.abs((window.simd.frame()?.joints.get("bench_arm")?.position[0] ?? 0) - 0.6) < 0.05);
  const { sequence } = (await daemon.joints.getJointStates({})).states?.stamp ?? {};
  await tab.caughtUp(sequence ?? 0n);
  expect((await counts(tab, session)).pictures).toBeGreaterThan(after.pictures);
});
