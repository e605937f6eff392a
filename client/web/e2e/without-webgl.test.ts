// A page that cannot draw shows the reason in the picture, and everything else works.

import type { Page } from "playwright-core";
import { expect, test } from "vitest";

import { Daemon } from "./daemon";
import { fixtures } from "./fixtures";

const use = fixtures();

/** Returns the text that the user sees in the middle of the picture. */
function inTheMiddle(page: Page): Promise<string> {
  return page.evaluate(() => {
    const box = document.querySelector("[data-testid=viewport]")?.getBoundingClientRect();
    return (box && document.elementFromPoint(box.left + box.width / 2, box.top + 0.44 * box.height)?.textContent) ?? "";
  });
}

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
  await expect.poll(() => inTheMiddle(page)).toContain("WebGL 2 is missing or switched off");
  const number = page.getByTestId("number").first();
  await number.fill("0.5");
  await number.press("Enter");
  await expect.poll(() => page.getByTestId("actual").first().textContent()).toMatch(/^0\.(49|50)/);
  await page.keyboard.press("Escape");
  await page.getByTestId("plot-joint").first().click();
  const coloured = () =>
    page
      .getByTestId("plot")
      .first()
      .locator("canvas")
      .first()
      .evaluate((canvas: HTMLCanvasElement) => {
        const data = canvas.getContext("2d")?.getImageData(0, 0, canvas.width, canvas.height).data ?? [];
        let count = 0;
        for (let at = 0; at < data.length; at += 4) {
          const [red = 0, green = 0, blue = 0] = [data[at], data[at + 1], data[at + 2]];
          if ((data[at + 3] ?? 0) > 100 && Math.max(red, green, blue) - Math.min(red, green, blue) > 60) count += 1;
        }
        return count;
      });
  await expect.poll(coloured).toBeGreaterThan(20);
  await page.screenshot({ path: `${import.meta.dirname}/../../../target/screenshots/without-webgl.png` });
});
