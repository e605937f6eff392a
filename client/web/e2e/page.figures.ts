// Time until the first robot is visible, states a second in a tab, and cost of tabs for the daemon.

import { resolve } from "node:path";

import type { Browser } from "playwright-core";
import { afterAll, beforeAll, test } from "vitest";

import { Base } from "../src/gen/simd/v1/entity_pb";
import { connect, Tab } from "./browser";
import { Daemon, REPOSITORY } from "./daemon";
import { pause, swing, used } from "./measuring";

/** Wall milliseconds of a measurement. */
const SPAN = 5000;

let browser: Browser;
beforeAll(async () => {
  browser = await connect();
});
afterAll(async () => {
  await browser.close();
});

/** Milliseconds by which steps were published later than the earliest by its clock: the 50th and the 99th percentile. */
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
  for (const count of [0, 1, 3, 7]) {
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

/**
 * Milliseconds of script: in animation frames that drew, and in the whole page; of all computing in its main thread; and megabytes that
 * scripts hold.
 */
async function measured(tab: Tab, span: number): Promise<string> {
  const drawing = () => tab.page.evaluate(() => (window as unknown as { drawing: number }).drawing);
  const before = await drawing();
  const { pictures, states, seconds, script, busy } = await used(tab, span);
  const drawn = (await drawing()) - before;
  const session = await tab.page.context().newCDPSession(tab.page);
  await session.send("HeapProfiler.collectGarbage");
  const heap = (await session.send("Runtime.getHeapUsage")).usedSize / 1e6;
  await session.detach();
  const each = pictures === 0 ? "none" : `${(drawn / pictures).toFixed(1)} ms`;
  const share = (of: number): string => ((100 * of) / seconds).toFixed(1);
  return `states/s ${(states / seconds).toFixed(1)} pictures/s ${(pictures / seconds).toFixed(2)} script a picture ${each}, all script ${share(script)} % of a core, main thread ${share(busy)} %, heap ${heap.toFixed(1)} MB`;
}

/** Counts the milliseconds that animation frames take, in `window.drawing`. */
function countFrames(): void {
  const page = window as unknown as { drawing: number };
  page.drawing = 0;
  const ask = window.requestAnimationFrame.bind(window);
  window.requestAnimationFrame = (draw) =>
    ask((at) => {
      const begun = performance.now();
      draw(at);
      page.drawing += performance.now() - begun;
    });
}

test("a hundred robots of 3,000 links in one tab", async () => {
  const daemon = await Daemon.start(["--asset-root", resolve(REPOSITORY, "tests/assets"), "--gravity", "0,0,0"]);
  const source = { source: { case: "path", value: resolve(REPOSITORY, "tests/assets/humanoid/urdf/humanoid.urdf") } } as const;
  let links = 0;
  for (let index = 0; index < 100; index += 1) {
    const name = `robot_${index}`;
    await daemon.entities.spawnEntity({ name, source, base: Base.FIXED, pose: { position: { x: (index % 10) * 2, y: Math.floor(index / 10) * 2, z: 1.5 } } });
    links += (await daemon.entities.getEntityInfo({ robot: name })).entity?.links.length ?? 0;
  }
  const context = await browser.newContext({ viewport: { width: 1280, height: 720 } });
  await context.addInitScript(countFrames);
  const begun = performance.now();
  const tab = await Tab.open(context, daemon.url);
  console.log(`100 robots, ${links} links: on the screen after ${(performance.now() - begun).toFixed(0)} ms`);
  const end = await swing(daemon, Array.from({ length: 100 }, (_, index) => `robot_${index}`), 0.05, 2000);
  await pause(2000);
  // Minutes until the memory is measured again: 10 for a figure of a release.
  const minutes = Number(process.env.FIGURES_MINUTES ?? "1");
  console.log(`moving: ${await measured(tab, 4 * SPAN)}`);
  await pause(minutes * 60_000);
  console.log(`moving, ${minutes} minutes later: ${await measured(tab, 4 * SPAN)}`);
  const tabs = [tab, await Tab.open(context, daemon.url), await Tab.open(context, daemon.url)];
  await pause(2000);
  const figures = await Promise.all(tabs.map((each) => measured(each, 4 * SPAN)));
  figures.forEach((figure, index) => console.log(`moving, tab ${index + 1} of 3: ${figure}`));
  for (const each of tabs.slice(1)) await each.page.close();
  await tab.page.bringToFront();
  await end();
  await pause(5000);
  console.log(`still, and playing: ${await measured(tab, 4 * SPAN)}`);
  await context.close();
  await daemon.stop();
});
