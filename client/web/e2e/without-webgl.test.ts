// A page that cannot draw shows the reason in the picture, and everything else works.

import { expect, test } from "vitest";

import { colouredPixels, inTheMiddle } from "./browser";
import { Daemon } from "./daemon";
import { fixtures } from "./fixtures";

const use = fixtures();

test("without WebGL the reason stands in the middle of the picture, and sliders and plots work", async () => {
  const daemon = await use.daemon(Daemon.demo());
  const context = await use.context();
  await context.addInitScript(() => {
    const { getContext } = HTMLCanvasElement.prototype;
    HTMLCanvasElement.prototype.getContext = function (this: HTMLCanvasElement, kind: string, ...rest: unknown[]) {
      return kind.startsWith("webgl") ? null : (getContext as (...all: unknown[]) => unknown).call(this, kind, ...rest);
    } as typeof getContext;
  });
  const page = await context.newPage();
  await page.goto(daemon.url);
  await expect.poll(() => page.evaluate(inTheMiddle)).toContain("WebGL 2 is missing or switched off");
  const number = page.getByTestId("number").first();
  await number.fill("0.5");
  await number.press("Enter");
  await expect.poll(() => page.getByTestId("actual").first().textContent()).toMatch(/^0\.(49|50)/);
  await page.keyboard.press("Escape");
  await page.getByTestId("plot-joint").first().click();
  await expect.poll(() => page.evaluate(colouredPixels)).toBeGreaterThan(20);
  await page.screenshot({ path: `${import.meta.dirname}/../../../target/screenshots/without-webgl.png` });
});
