// Handles in the picture are dragged: they turn the base of a robot, and a joint.

import { expect, test } from "vitest";

import { Base } from "../src/gen/simd/v1/entity_pb";
import { Tab } from "./browser";
import { Daemon } from "./daemon";
import { fixtures } from "./fixtures";

const use = fixtures();

type Vector = [number, number, number];

/** Rings of three's handles have half of this radius: metres, for a camera of 38 degrees at this distance. */
const ringRadius = (distance: number): number => (0.5 * distance * 1.9 * Math.tan((19 * Math.PI) / 180)) / 4;

/** Looks at a point from another, and waits until it is drawn. */
async function look(tab: Tab, from: Vector, to: Vector): Promise<void> {
  await tab.page.evaluate(([from, to]) => window.simd.camera.look(from, to), [from, to] as const);
  await tab.page.waitForFunction(() => window.simd.settled());
}

/** Drags from a point of the world by this many pixels. */
async function drag(tab: Tab, at: Vector, [right, down]: [number, number]): Promise<void> {
  const { x, y } = await tab.project(at);
  await tab.onHandle({ x, y });
  await tab.page.mouse.down();
  await tab.page.mouse.move(x + right, y + down, { steps: 8 });
  await tab.page.mouse.up();
}

async function place(tab: Tab): Promise<void> {
  await tab.page.getByTestId("build").click();
  await tab.page.getByTestId("build-place").click();
  await tab.page.getByTestId("place-card").waitFor();
}

test("the base of a robot is turned about one axis by its ring, and returns by undo", async () => {
  const daemon = await use.daemon(Daemon.start(["--paused", "--gravity", "0,0,0"]));
  const primitive = { geometry: { case: "box", value: { size: { x: 0.4, y: 0.4, z: 0.4 } } }, mass: 1 } as const;
  await daemon.entities.spawnEntity({ name: "crate", base: Base.FREE, pose: { position: { x: 0, y: 0, z: 0.5 } }, source: { source: { case: "primitive", value: primitive } } });
  const tab = await Tab.open(await use.context(), daemon.url);
  const turn = async () => (await daemon.entities.getEntityState({ robot: "crate" })).pose?.orientation ?? { x: NaN, y: NaN, z: NaN, w: NaN };
  await place(tab);
  await tab.page.getByTestId("place-rotate").click();
  const eye: Vector = [2, 2, 2];
  await look(tab, eye, [0, 0, 0.5]);
  // The point of the ring about z that is nearest to the camera, where no other ring passes.
  const along = ringRadius(Math.hypot(2, 2, 1.5)) * Math.SQRT1_2;
  await drag(tab, [along, along, 0.5], [60, 0]);
  await expect.poll(async () => Math.abs((await turn()).z)).toBeGreaterThan(0.05);
  const { x, y } = await turn();
  expect(Math.hypot(x, y)).toBeLessThan(1e-9);
  await tab.picture("handles-turned");
  await tab.page.keyboard.press("Control+z");
  await expect.poll(async () => Math.abs((await turn()).z)).toBeLessThan(1e-6);
  expect(tab.consoleMessages).toEqual([]);
});

test("a joint is turned by its ring in a paused world, and no other joint is", async () => {
  const daemon = await use.daemon(Daemon.demo("--paused"));
  const tab = await Tab.open(await use.context(), daemon.url);
  const position = async (joint: string) => (await daemon.joint("bench_arm", joint)).position;
  const { layout } = await daemon.joints.getJointLayout({ robot: "bench_arm" });
  const shoulder = layout?.joints.find(({ name }) => name === "shoulder");
  const others = layout?.joints.filter(({ name, limits }) => name !== "shoulder" && limits !== undefined).map(({ name }) => name) ?? [];
  const before = await Promise.all(others.map(position));
  const began = await position("shoulder");
  await place(tab);
  await tab.page.getByTestId("place-part").selectOption("joint shoulder");
  const [x = 0, y = 0, z = 0] = await daemon.linkPose("bench_arm", shoulder?.childLink ?? "");
  // The view is along the axis, which is y: the ring appears as a circle.
  const center: Vector = [x, y, z];
  await look(tab, [x + 0.3, y - 2.5, z + 0.3], center);
  const radius = ringRadius(Math.hypot(0.3, 2.5, 0.3));
  await drag(tab, [x, y, z + radius], [50, 0]);
  await expect.poll(async () => Math.abs((await position("shoulder")) - began)).toBeGreaterThan(0.05);
  expect(await Promise.all(others.map(position))).toEqual(before);
  await tab.picture("handles-joint");
  await tab.page.keyboard.press("Control+z");
  await expect.poll(() => position("shoulder")).toBeCloseTo(began, 6);
  expect(tab.consoleMessages).toEqual([]);
});
