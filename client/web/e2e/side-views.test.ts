// Several views at once: small side views show the same robots, each from its side.

import { expect, test } from "vitest";

import { Base } from "../src/gen/simd/v1/entity_pb";
import { SimulationState } from "../src/gen/simd/v1/simulation_pb";
import { Tab } from "./browser";
import { Daemon } from "./daemon";
import { fixtures } from "./fixtures";

const use = fixtures();

test("views from the front, the left and above show where things are, and lead the camera there", async () => {
  const daemon = await use.daemon(Daemon.start(["--gravity", "0,0,0"]));
  await daemon.simulation.setSimulationState({ state: SimulationState.PAUSED });
  // The red robot is to the robot's left of the middle (towards y) and below it; the grey one makes the middle the
  // origin.
  for (const [name, y, z, color] of [["red", 0.6, -0.4, { red: 1, green: 0, blue: 0, alpha: 1 }], ["grey", -0.6, 0.4, { red: 0.5, green: 0.5, blue: 0.5, alpha: 1 }]] as const) {
    const primitive = { geometry: { case: "box", value: { size: { x: 0.3, y: 0.3, z: 0.3 } } }, mass: 1, color } as const;
    await daemon.entities.spawnEntity({ name, base: Base.FIXED, pose: { position: { x: 0, y, z } }, source: { source: { case: "primitive", value: primitive } } });
  }
  const tab = await Tab.open(await use.context(), daemon.url);
  await tab.page.keyboard.press("w");
  await tab.page.getByTestId("side-top").waitFor();
  await tab.page.waitForFunction(() => window.simd.settled());
  /** Returns the middle of the red pixels within a view, from -1 to 1, to the right and up. */
  const red = async (side: string): Promise<[number, number]> => {
    const frame = await tab.page.getByTestId(`side-${side}`).boundingBox();
    if (frame === null) throw new Error("the view has no size");
    const area = { left: frame.x + 2, right: frame.x + frame.width - 2, top: frame.y + 2, bottom: frame.y + frame.height - 2 };
    const { box, pixels } = await tab.seen(area, -15, 15);
    expect(pixels, side).toBeGreaterThan(50);
    return [((box.left + box.right) / 2 - (area.left + area.right) / 2) / (frame.width / 2), ((area.top + area.bottom) / 2 - (box.top + box.bottom) / 2) / (frame.height / 2)];
  };
  await tab.picture("side-views");
  // A view from the front has the robot's left at the right; a view from above has x at the right.
  const [front, left, top] = [await red("front"), await red("left"), await red("top")];
  expect(front[0]).toBeGreaterThan(0.15);
  expect(front[1]).toBeLessThan(-0.15);
  expect(Math.abs(left[0])).toBeLessThan(0.1);
  expect(left[1]).toBeLessThan(-0.15);
  expect(Math.abs(top[0])).toBeLessThan(0.1);
  expect(top[1]).toBeGreaterThan(0.15);
  expect(await tab.violations()).toEqual([]);

  await tab.page.getByTestId("side-top").click();
  const camera = () => tab.page.evaluate(() => [window.simd.camera.position(), window.simd.camera.target()]);
  await expect.poll(async () => {
    const [at = [], to = []] = await camera();
    return Math.hypot((at[0] ?? 0) - (to[0] ?? 0), (at[1] ?? 0) - (to[1] ?? 0));
  }).toBeLessThan(0.01);
  // They are kept over a reload of the tab, and the same key hides them.
  await tab.page.reload();
  await tab.page.getByTestId("side-front").waitFor();
  await tab.page.waitForFunction(() => window.simd?.settled());
  await tab.page.keyboard.press("w");
  await tab.page.getByTestId("side-front").waitFor({ state: "detached" });
  const phone = await Tab.open(await use.context({ viewport: { width: 390, height: 844 } }), daemon.url);
  await phone.page.keyboard.press("w");
  const [first, last] = [await phone.page.getByTestId("side-front").boundingBox(), await phone.page.getByTestId("side-top").boundingBox()];
  expect(last?.y).toBe(first?.y);
  await phone.picture("side-views-phone");
  expect(tab.consoleMessages).toEqual([]);
});
