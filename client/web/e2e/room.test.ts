// Pages with little room: a phone on its side, and large text.

import type { BrowserContextOptions } from "playwright-core";
import { expect, test } from "vitest";

import { Base } from "../src/gen/simd/v1/entity_pb";
import { demoArm } from "../src/load/demo-arm";
import { rowOfBar, seenAtMiddle, Tab } from "./browser";
import { Daemon } from "./daemon";
import { fixtures } from "./fixtures";

const use = fixtures();

const NAME = "arm-with-a-name-that-is-longer-than-any-panel-of-a-phone-is-wide-left";

const seen = (tab: Tab, selector: string) => tab.page.evaluate(seenAtMiddle, selector);

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
    const { spread, over } = await tab.page.evaluate(rowOfBar);
    expect(spread).toBeLessThan(0.3);
    expect(over).toBeLessThanOrEqual(0);
    // Without words the buttons below the picture differ by their icons.
    const icons = await tab.page.locator(".view-toggles svg").evaluateAll((all) => all.map((icon) => icon.innerHTML));
    expect(new Set(icons).size).toBe(icons.length);
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
