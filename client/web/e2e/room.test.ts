// Pages with little room: a phone on its side, and large text.

import type { BrowserContextOptions } from "playwright-core";
import { expect, test } from "vitest";

import { Base } from "../src/gen/simd/v1/entity_pb";
import { demoArm } from "../src/load/demo-arm";
import { Tab } from "./browser";
import { Daemon } from "./daemon";
import { fixtures } from "./fixtures";

const use = fixtures();

const NAME = "arm-with-a-name-that-is-longer-than-any-panel-of-a-phone-is-wide-left";

/** Returns how many of these elements are visible at their middle, and their number. */
function seen(tab: Tab, selector: string): Promise<{ seen: number; all: number }> {
  return tab.page.evaluate((wanted) => {
    const all = [...document.querySelectorAll<HTMLElement>(wanted)];
    const hit = all.filter((element) => {
      const { left, top, width, height } = element.getBoundingClientRect();
      const found = document.elementFromPoint(left + width / 2, top + height / 2);
      return found !== null && (element.contains(found) || found.contains(element));
    });
    return { seen: hit.length, all: all.length };
  }, selector);
}

const ROOMS: readonly { name: string; options: BrowserContextOptions; text: string }[] = [
  { name: "phone-that-lies", options: { viewport: { width: 740, height: 360 }, hasTouch: true }, text: "auto" },
  { name: "text-of-200", options: { viewport: { width: 1280, height: 720 } }, text: "200" },
];

test("a phone that lies, and text of 200 %, show joints, a bar of one row, and messages that cover no button", async () => {
  const daemon = await use.daemon(Daemon.start(["--gravity", "0,0,0"]));
  await daemon.entities.spawnEntity({ name: NAME, source: { source: { case: "urdf", value: new TextEncoder().encode(demoArm()) } }, base: Base.FIXED });
  await daemon.entities.spawnEntity({ name: "second", source: { source: { case: "urdf", value: new TextEncoder().encode(demoArm()) } }, base: Base.FIXED, pose: { position: { x: 0, y: 1, z: 0 } } });
  for (const { name, options, text } of ROOMS) {
    const context = await use.context(options);
    await context.addInitScript((size) => localStorage.setItem("simd.view.textSize", JSON.stringify(size)), text);
    const tab = await Tab.open(context, daemon.url);
    await expect.poll(() => tab.page.getByTestId("slider").count()).toBe(5);
    expect(await tab.page.title()).toBe(`${NAME} · simd`);
    expect((await seen(tab, "[data-testid=slider]")).seen, "sliders that are seen").toBeGreaterThanOrEqual(2);
    // One row, without anything outside.
    const bar = await tab.page.locator(".top-bar").evaluate((element) => {
      const middles = [...element.children].map((child) => child.getBoundingClientRect()).filter(({ width }) => width > 0).map(({ top, height }) => top + height / 2);
      return { spread: Math.max(...middles) - Math.min(...middles), over: element.scrollWidth - element.clientWidth, height: element.clientHeight };
    });
    expect(bar.spread).toBeLessThan(0.3 * bar.height);
    expect(bar.over).toBeLessThanOrEqual(0);
    // The end of a long name is visible.
    expect(await tab.page.locator(".robot-name .end").textContent()).toBe("is-wide-left");
    const number = tab.page.getByTestId("number").first();
    await number.fill("2 foo");
    await number.press("Enter");
    // A message disappears after some seconds.
    await expect.poll(async () => (await seen(tab, "[data-testid=toast]")).seen).toBe(1);
    const buttons = await seen(tab, ".view-toggles > button");
    expect(buttons.seen).toBe(buttons.all);
    expect(await tab.violations()).toEqual([]);
    await tab.picture(name);
  }
});
