// How soon the first robot is seen, how many states a second a tab shows, and what tabs cost the daemon.

import { resolve } from "node:path";

import type { Browser } from "playwright-core";
import { afterAll, beforeAll, test } from "vitest";

import { Base } from "../src/gen/simd/v1/entity_pb";
import { launch, Tab } from "./browser";
import { Daemon, REPOSITORY } from "./daemon";

/** Wall milliseconds over which is counted. */
const SPAN = 5000;

let browser: Browser;
beforeAll(async () => {
  browser = await launch();
});
afterAll(async () => {
  await browser.close();
});

const pause = (milliseconds: number): Promise<void> => new Promise((done) => setTimeout(done, milliseconds));

/** Milliseconds by which steps were published later than the earliest by its own clock: the 50th and the 99th of a hundred. */
async function lateness(daemon: Daemon): Promise<string> {
  const behind: number[] = [];
  for (const end = performance.now() + SPAN; performance.now() < end; await pause(5)) {
    const stamp = (await daemon.joints.getJointStates({})).states?.stamp;
    if (stamp?.wallTime === undefined) continue;
    behind.push(Number(stamp.wallTime.seconds % 100_000n) * 1e3 + stamp.wallTime.nanos / 1e6 - stamp.simTime * 1e3);
  }
  behind.sort((a, b) => a - b);
  const at = (share: number): string => ((behind[Math.floor(share * (behind.length - 1))] ?? 0) - (behind[0] ?? 0)).toFixed(3);
  return `p50 ${at(0.5)} p99 ${at(0.99)} ms of ${behind.length} steps`;
}

async function threeRobots(): Promise<Daemon> {
  const daemon = await Daemon.demo("--asset-root", resolve(REPOSITORY, "tests/assets"));
  for (const [path, z] of [["seven_arm", 0], ["humanoid", 1.5]] as const) {
    const source = { source: { case: "path", value: resolve(REPOSITORY, `tests/assets/${path}/urdf/${path}.urdf`) } } as const;
    await daemon.entities.spawnEntity({ source, base: Base.FIXED, pose: { position: { x: 0, y: z + 0.8, z } } });
  }
  return daemon;
}

test("the first robot", async () => {
  const daemon = await Daemon.demo();
  const times = [];
  for (let i = 0; i < 5; i += 1) {
    const context = await browser.newContext({ viewport: { width: 1280, height: 720 } });
    const begun = performance.now();
    await Tab.open(context, daemon.url);
    times.push(performance.now() - begun);
    await context.close();
  }
  console.log(`first robot on the screen, empty cache, ms: ${times.map((time) => time.toFixed(0)).join(" ")}`);
  await daemon.stop();
});

test("states a second, and the daemon's real-time factor", async () => {
  const daemon = await threeRobots();
  for (const count of [0, 1, 7]) {
    const context = await browser.newContext({ viewport: { width: 1280, height: 720 } });
    const tabs: Tab[] = [];
    for (let i = 0; i < count; i += 1) tabs.push(await Tab.open(context, daemon.url));
    await pause(2000);
    const read = () => Promise.all(tabs.map((tab) => tab.page.evaluate(() => [window.simd.stats.frames(), window.simd.stats.pictures()] as const)));
    const before = await read();
    const started = performance.now();
    const from = (await daemon.simulation.getWorldStatistics({})).statistics;
    const late = await lateness(daemon);
    const seconds = (performance.now() - started) / 1000;
    const after = await read();
    const to = (await daemon.simulation.getWorldStatistics({})).statistics;
    const rate = (which: 0 | 1) => after.map((now, i) => ((now[which] - (before[i]?.[which] ?? 0)) / seconds).toFixed(0)).join(" ");
    console.log(
      `${count} tabs: states/s [${rate(0)}] pictures/s [${rate(1)}] real-time factor ${to?.realTimeFactor.toFixed(5)}, ` +
        `overruns ${Number((to?.overruns ?? 0n) - (from?.overruns ?? 0n))}, step ${((to?.stepDuration ?? 0) * 1e6).toFixed(1)} us, lateness ${late}`,
    );
    await context.close();
  }
  await daemon.stop();
});
