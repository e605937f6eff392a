// Pictures a second of moving arms on a machine that draws in software. PAGES names folders of pages to compare; without it the daemon's page is
// measured. ARMS names the numbers of arms.

import type { Browser } from "playwright-core";
import { afterAll, beforeAll, test } from "vitest";

import { Base } from "../src/gen/simd/v1/entity_pb";
import { demoArm } from "../src/load/demo-arm";
import { connect, servePage, Tab } from "./browser";
import { Daemon } from "./daemon";
import { pause, swing, used } from "./measuring";

/** Wall milliseconds of a measurement, and before it. */
const SPAN = Number(process.env["SPAN"] ?? "6000");
const WARM = 3000;

let browser: Browser;
beforeAll(async () => {
  browser = await connect();
});
afterAll(async () => {
  await browser.close();
});

async function arms(count: number): Promise<{ daemon: Daemon; names: string[] }> {
  const daemon = await Daemon.start(["--gravity", "0,0,0"]);
  const urdf = new TextEncoder().encode(demoArm());
  const names = Array.from({ length: count }, (_, index) => `arm_${index}`);
  for (const [index, name] of names.entries()) {
    await daemon.entities.spawnEntity({ name, source: { source: { case: "urdf", value: urdf } }, base: Base.FIXED, pose: { position: { x: (index % 10) * 1.5, y: Math.floor(index / 10) * 1.5, z: 0 } } });
  }
  await daemon.entities.spawnEntity({ name: "ground", source: { source: { case: "primitive", value: { geometry: { case: "plane", value: {} } } } }, base: Base.FIXED });
  return { daemon, names };
}

for (const count of (process.env["ARMS"] ?? "1 10 100").split(" ").map(Number)) {
  test(`${count} moving arms`, async () => {
    const { daemon, names } = await arms(count);
    const end = await swing(daemon, names, 0.3, 1000);
    for (const [index, page] of (process.env["PAGES"] ?? "").split(" ").entries()) {
      for (const panel of [true, false]) {
        const context = await browser.newContext({ viewport: { width: 1000, height: 640 } });
        if (page !== "") await servePage(context, page);
        await context.addInitScript((open) => localStorage.setItem("simd.view.panelOpen", JSON.stringify(open)), panel);
        const begun = performance.now();
        const tab = await Tab.open(context, daemon.url);
        const opened = performance.now() - begun;
        await pause(WARM);
        const use = await used(tab, SPAN);
        const each = (["gpu", "browser", "renderer", "busy"] as const).map((of) => `${of} ${((1e3 * use[of]) / use.pictures).toFixed(1)}`);
        console.log(
          `${count} arms, ${page || "the daemon's page"}, ${panel ? "with" : "without"} panel: ${(use.pictures / use.seconds).toFixed(1)} pictures/s; a picture takes ms of a core: ${each.join(", ")}; opened in ${opened.toFixed(0)} ms`,
        );
        await tab.picture(`draft-${count}-${index}-${panel}`);
        await context.close();
      }
    }
    await end();
    await daemon.stop();
  });
}
