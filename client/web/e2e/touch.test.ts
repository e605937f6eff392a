// Operation only by touch: without hover, and without a right button.

import { resolve } from "node:path";

import { type CDPSession } from "playwright-core";
import { expect, test } from "vitest";

import { Base } from "../src/gen/simd/v1/entity_pb";
import { Tab } from "./browser";
import { Daemon, REPOSITORY } from "./daemon";
import { fixtures } from "./fixtures";
import { corners, moved } from "./mesh";

const use = fixtures();

interface Point {
  x: number;
  y: number;
}

/** Moves fingers from their starts to their ends. */
async function drag(session: CDPSession, fingers: readonly (readonly [Point, Point])[], lift = true): Promise<void> {
  const at = (share: number) => fingers.map(([from, to], id) => ({ id, x: from.x + share * (to.x - from.x), y: from.y + share * (to.y - from.y) }));
  await session.send("Input.dispatchTouchEvent", { type: "touchStart", touchPoints: at(0) });
  for (let step = 1; step <= 8; step += 1) await session.send("Input.dispatchTouchEvent", { type: "touchMove", touchPoints: at(step / 8) });
  if (lift) await session.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
}

test("fingers orbit, zoom, select, pull, slide and build", async () => {
  // Without gravity nothing else moves the arm.
  const daemon = await use.daemon(Daemon.demo("--gravity", "0,0,0"));
  const box = { geometry: { case: "box", value: { size: { x: 0.3, y: 0.3, z: 0.3 } } }, mass: 1, color: { red: 1, green: 0, blue: 0, alpha: 1 } } as const;
  await daemon.entities.spawnEntity({ name: "wall", base: Base.FIXED, pose: { position: { x: 0, y: -1, z: 1 } }, source: { source: { case: "primitive", value: box } } });
  const context = await use.context({ hasTouch: true, isMobile: true, viewport: { width: 820, height: 1100 } });
  const tab = await Tab.open(context, daemon.url);
  const session = await context.newCDPSession(tab.page);
  const view = await tab.page.getByTestId("viewport").boundingBox();
  if (view === null) throw new Error("the view has no size");
  const camera = () => tab.page.evaluate(() => ({ at: window.simd.camera.position(), to: window.simd.camera.target() }));
  const still = () => tab.page.waitForFunction(() => window.simd.settled());
  const distance = ({ at, to }: { at: number[]; to: number[] }) => Math.hypot(...at.map((value, axis) => value - (to[axis] ?? NaN)));
  // One finger in a corner, where no link is, orbits; two that part zoom.
  const corner = { x: view.x + 40, y: view.y + 40 };
  const before = await camera();
  await drag(session, [[corner, { x: corner.x + 120, y: corner.y + 30 }]]);
  await expect.poll(async () => Math.hypot(...(await camera()).at.map((value, axis) => value - (before.at[axis] ?? NaN)))).toBeGreaterThan(0.05);
  await still();
  const far = distance(await camera());
  const middle = { x: view.x + view.width / 2, y: view.y + view.height - 120 };
  await drag(session, [[{ x: middle.x - 40, y: middle.y }, { x: middle.x - 160, y: middle.y }], [{ x: middle.x + 40, y: middle.y }, { x: middle.x + 160, y: middle.y }]]);
  await expect.poll(async () => distance(await camera())).toBeLessThan(0.9 * far);
  await tab.page.getByTestId("fit").tap();
  await still();
  // A link of the arm is pulled and released.
  await daemon.joints.setJointTargets({ robots: [{ robot: "bench_arm", joints: [{ joint: "shoulder", target: { case: "passive", value: {} } }] }] });
  const points = await corners(resolve(REPOSITORY, "tests/assets/Bench_Arm-1.2 rev B/meshes/arm.STL"));
  const end = points.reduce((best, point) => ((point[0] ?? 0) > (best[0] ?? 0) ? point : best));
  const grip = await tab.project(moved(await daemon.linkPose("bench_arm", "arm"), [0.85 * (end[0] ?? 0), end[1] ?? 0, 0]));
  const angle = async () => (await daemon.joint("bench_arm", "shoulder")).position;
  const rest = await angle();
  await drag(session, [[grip, { x: grip.x + 10, y: grip.y - 160 }]], false);
  await expect.poll(async () => Math.abs((await angle()) - rest)).toBeGreaterThan(0.05);
  await session.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
  // A tap selects the robot under it.
  const wall = await tab.project([0, -1, 1]);
  await tab.page.touchscreen.tap(wall.x, wall.y);
  await tab.page.getByTestId("robot-bench_arm").tap();
  // A slider.
  const slider = await tab.page.getByTestId("slider").first().boundingBox();
  if (slider === null) throw new Error("the slider has no size");
  const grab = { x: slider.x + slider.width / 2, y: slider.y + slider.height / 2 };
  await drag(session, [[grab, { x: grab.x + slider.width / 8, y: grab.y }]]);
  await expect.poll(async () => Math.abs((await daemon.joint("bench_arm", "shoulder")).target)).toBeGreaterThan(0.3);
  // The tools are buttons.
  await tab.page.getByTestId("build").tap();
  await tab.page.getByTestId("build-add").tap();
  await tab.page.getByTestId("add-now").tap();
  await expect.poll(async () => (await daemon.entities.listEntities({})).entities.length).toBe(3);
  await tab.picture("touch");
  expect(tab.consoleMessages).toEqual([]);
});
