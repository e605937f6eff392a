// Pictures a second of moving arms on a machine that draws in software. PAGES names folders of pages to compare; without it the daemon's page is
// measured.

import type { Browser } from "playwright-core";
import { afterAll, beforeAll, test } from "vitest";

import { Base } from "../src/gen/simd/v1/entity_pb";
import { demoArm } from "../src/load/demo-arm";
import { connect, servePage, Tab } from "./browser";
import { Daemon } from "./daemon";

/** Wall milliseconds of a measurement, and before it. */
const SPAN = 6000;
const WARM = 3000;

let browser: Browser;
beforeAll(async () => {
  browser = await connect();
});
afterAll(async () => {
  await browser.close();
});

const pause = (milliseconds: number): Promise<void> => new Promise((done) => setTimeout(done, milliseconds));

async function moving(count: number): Promise<{ daemon: Daemon; end: () => void }> {
  const daemon = await Daemon.start(["--gravity", "0,0,0"]);
  const urdf = new TextEncoder().encode(demoArm());
  const names = Array.from({ length: count }, (_, index) => `arm_${index}`);
  for (const [index, name] of names.entries()) {
    await daemon.entities.spawnEntity({ name, source: { source: { case: "urdf", value: urdf } }, base: Base.FIXED, pose: { position: { x: (index % 10) * 1.5, y: Math.floor(index / 10) * 1.5, z: 0 } } });
  }
  await daemon.entities.spawnEntity({ name: "ground", source: { source: { case: "primitive", value: { geometry: { case: "plane", value: {} } } } }, base: Base.FIXED });
  const { layout } = await daemon.joints.getJointLayout({ robot: "arm_0" });
  const joint = layout?.joints.find(({ limits, mimic }) => limits !== undefined && !mimic)?.name ?? "";
  let velocity = 0.3;
  const swing = (): void => {
    velocity = -velocity;
    void daemon.joints.setJointTargets({ robots: names.map((robot) => ({ robot, joints: [{ joint, target: { case: "velocity", value: { velocity } } as const }] })) });
  };
  swing();
  const timer = setInterval(swing, 1000);
  return { daemon, end: () => clearInterval(timer) };
}

for (const count of (process.env["ARMS"] ?? "1 10 100").split(" ").map(Number)) {
  test(`${count} moving arms`, async () => {
    const { daemon, end } = await moving(count);
    for (const page of (process.env["PAGES"] ?? "").split(" ")) {
      for (const panel of [true, false]) {
        const context = await browser.newContext({ viewport: { width: 1000, height: 640 } });
        if (page !== "") await servePage(context, page);
        await context.addInitScript((open) => localStorage.setItem("simd.view.panelOpen", JSON.stringify(open)), panel);
        const begun = performance.now();
        const tab = await Tab.open(context, daemon.url);
        const opened = performance.now() - begun;
        await pause(WARM);
        const session = await context.newCDPSession(tab.page);
        await session.send("Performance.enable");
        const whole = await browser.newBrowserCDPSession();
        const read = async () => {
          const { metrics } = await session.send("Performance.getMetrics");
          const busy = metrics.find(({ name }) => name === "ThreadTime")?.value ?? 0;
          const { processInfo } = await whole.send("SystemInfo.getProcessInfo");
          const of = (type: string): number => processInfo.filter((each) => each.type === type).reduce((sum, { cpuTime }) => sum + cpuTime, 0);
          return { gpu: of("GPU"), browser: of("browser"), renderer: of("renderer"), busy, pictures: await tab.page.evaluate(() => window.simd.stats.pictures()), at: performance.now() };
        };
        const before = await read();
        await pause(SPAN);
        const after = await read();
        const seconds = (after.at - before.at) / 1e3;
        console.log(
          `${count} arms, ${page || "the daemon's page"}, ${panel ? "with" : "without"} panel: ${((after.pictures - before.pictures) / seconds).toFixed(1)} pictures/s; a picture takes ms of a core ${(["gpu", "browser", "renderer", "busy"] as const).map((of) => `${of} ${((1e3 * (after[of] - before[of])) / (after.pictures - before.pictures)).toFixed(1)}`).join(", ")}; opened in ${opened.toFixed(0)} ms`,
        );
        await tab.picture(`draft-${count}-${page.includes("ci2") ? "before" : "after"}-${panel}`);
        await context.close();
      }
    }
    end();
    await daemon.stop();
  });
}
