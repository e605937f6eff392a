// Insight into a world: plots of any series, contact forces, ellipsoids of inertia, and points of lidars.

import { expect, test } from "vitest";

import { Base } from "../src/gen/simd/v1/entity_pb";
import { SimulationState } from "../src/gen/simd/v1/simulation_pb";
import { Tab } from "./browser";
import { Daemon } from "./daemon";
import { fixtures } from "./fixtures";

const use = fixtures();

/** A box of 2 kg that lies on a plane. */
async function lying(): Promise<Daemon> {
  const daemon = await use.daemon(Daemon.start([]));
  const box = { geometry: { case: "box", value: { size: { x: 0.4, y: 0.4, z: 0.4 } } }, mass: 2 } as const;
  await daemon.entities.spawnEntity({ name: "ground", base: Base.FIXED, source: { source: { case: "primitive", value: { geometry: { case: "plane", value: {} } } } } });
  await daemon.entities.spawnEntity({ name: "crate", base: Base.FREE, pose: { position: { x: 0, y: 0, z: 0.2 } }, source: { source: { case: "primitive", value: box } } });
  await daemon.simulation.setSimulationState({ state: SimulationState.PLAYING });
  return daemon;
}

test("the place of a base and the force on a link are plotted, kept over a reload, with a value at the pointer", async () => {
  const daemon = await lying();
  const tab = await Tab.open(await use.context(), daemon.url);
  await tab.page.getByTestId("robot-crate").click();
  await tab.page.keyboard.press("p");
  const picker = tab.page.getByTestId("series-picker");
  await picker.waitFor();
  await picker.selectOption("base/crate/z");
  await picker.selectOption("contact/crate/link");
  await expect.poll(() => tab.page.getByTestId("series-plot").count()).toBe(2);
  await daemon.pass(2);
  // Above its wall of samples, with some time behind it.
  const plot = tab.page.getByTestId("series-plot").last();
  const box = await plot.locator(".u-over").boundingBox();
  if (box === null) throw new Error("the plot has no size");
  const readout = plot.locator(".plot-readout");
  await expect.poll(async () => {
    await tab.page.mouse.move(box.x + box.width * 0.06, box.y + box.height / 2);
    await tab.page.mouse.move(box.x + box.width * 0.07, box.y + box.height / 2);
    return Number(/force ([\d.]+) N/.exec((await readout.textContent()) ?? "")?.[1]);
  }).toBeCloseTo(2 * 9.81, 0);
  expect(await tab.violations()).toEqual([]);
  await tab.picture("series");
  await tab.page.reload();
  await expect.poll(() => tab.page.getByTestId("series-plot").count()).toBe(2);
});

test("the force of a contact is shown next to it", async () => {
  const daemon = await lying();
  const tab = await Tab.open(await use.context(), daemon.url);
  await tab.page.keyboard.press("k");
  const labels = async () => (await tab.page.locator(".scene-label:not([hidden])").allTextContents()).filter((text) => text.endsWith(" N"));
  const sum = async () => (await labels()).reduce((total, text) => total + parseFloat(text), 0);
  // Once it has come to rest.
  await expect.poll(async () => ((await sum()) - 2 * 9.81) / (2 * 9.81)).toBeCloseTo(0, 1);
  // The scale is as long as the arrow of its force: the weight of 2 kg is half the radius of the scene.
  const scale = tab.page.getByTestId("contact-scale");
  const newtons = parseFloat((await scale.textContent()) ?? "");
  const bar = (await scale.boundingBox())?.width ?? NaN;
  expect(newtons).toBeGreaterThan(0);
  const radius = 0.2 * Math.sqrt(3);
  const pixels = await tab.page.evaluate(() => {
    const [at, to] = [window.simd.camera.position(), window.simd.camera.target()];
    const distance = Math.hypot(...at.map((value, axis) => value - (to[axis] ?? NaN)));
    return (document.querySelector("canvas")?.clientHeight ?? NaN) / (2 * distance * Math.tan((19 * Math.PI) / 180));
  });
  expect(bar / (((0.5 * newtons) / (2 * 9.81)) * radius * pixels)).toBeCloseTo(1, 1);
  await tab.page.keyboard.press("e");
  await expect.poll(() => tab.page.getByTestId("toggle-inertias").getAttribute("aria-pressed")).toBe("true");
  await tab.page.waitForFunction(() => window.simd.settled());
  await tab.picture("contacts-and-inertias");
  expect(await tab.violations()).toEqual([]);
});

test("hits of a lidar are points in the picture", async () => {
  const daemon = await lying();
  const wall = { geometry: { case: "box", value: { size: { x: 0.2, y: 6, z: 2 } } }, mass: 1 } as const;
  await daemon.entities.spawnEntity({ name: "wall", base: Base.FIXED, pose: { position: { x: 2, y: 0, z: 1 } }, source: { source: { case: "primitive", value: wall } } });
  const kind = { case: "lidar", value: { horizontal: { samples: 21, min: -0.5, max: 0.5 }, range: { min: 0.1, max: 10 } } } as const;
  await daemon.sensors.createSensor({ sensor: { robot: "crate", name: "eye", rate: 10, pose: { position: { x: 0.3, y: 0, z: 0.3 } }, kind } });
  const tab = await Tab.open(await use.context(), daemon.url);
  await tab.page.getByTestId("robot-crate").click();
  await expect.poll(() => tab.page.evaluate(() => window.simd.points())).toBe(21);
  await tab.picture("lidar");
  await tab.page.keyboard.press("u");
  await expect.poll(() => tab.page.evaluate(() => window.simd.points())).toBe(0);
});
