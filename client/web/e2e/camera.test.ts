// The camera by keys and by its menu: sides, projection, following a robot, pictures.

import { readFile } from "node:fs/promises";
import { resolve } from "node:path";

import { beforeEach, expect, test } from "vitest";

import { Base } from "../src/gen/simd/v1/entity_pb";
import { demoArm } from "../src/load/demo-arm";
import { savedFile, Tab } from "./browser";
import { Daemon, REPOSITORY } from "./daemon";
import { fixtures } from "./fixtures";
import { corners, moved } from "./mesh";

const use = fixtures();
let daemon: Daemon;

type Vector = [number, number, number];

async function camera(tab: Tab): Promise<{ position: Vector; target: Vector; away: Vector; distance: number }> {
  await tab.page.waitForFunction(() => window.simd.settled());
  const { position, target } = await tab.page.evaluate(() => ({ position: window.simd.camera.position(), target: window.simd.camera.target() }));
  const away = position.map((value, index) => value - (target[index] ?? 0)) as Vector;
  return { position, target, away, distance: Math.hypot(...away) };
}

beforeEach(async () => {
  daemon = await use.daemon(Daemon.demo());
});

test("the keyboard turns, moves and zooms the camera", async () => {
  const tab = await Tab.open(await use.context(), daemon.url);
  const start = await camera(tab);
  await tab.page.keyboard.press("ArrowRight");
  const turned = await camera(tab);
  expect(turned.distance).toBeCloseTo(start.distance, 6);
  expect(turned.target[0]).toBeCloseTo(start.target[0], 6);
  const turn = Math.atan2(turned.away[1], turned.away[0]) - Math.atan2(start.away[1], start.away[0]);
  expect(turn).toBeCloseTo(Math.PI / 36, 3);
  await tab.page.keyboard.press("ArrowUp");
  expect((await camera(tab)).away[2]).toBeGreaterThan(turned.away[2]);
  await tab.page.keyboard.press("Shift+ArrowLeft");
  const moved = await camera(tab);
  expect(Math.hypot(moved.target[0] - start.target[0], moved.target[1] - start.target[1])).toBeCloseTo(0.05 * start.distance, 3);
  await tab.page.keyboard.press("+");
  expect((await camera(tab)).distance).toBeCloseTo(0.9 * start.distance, 3);
  // In the panel the arrow keys belong to the sliders.
  await tab.page.getByTestId("slider").first().focus();
  const before = await camera(tab);
  await tab.page.keyboard.press("ArrowRight");
  await expect.poll(async () => (await daemon.joint("bench_arm", "shoulder")).target).not.toBe(0);
  (await camera(tab)).position.forEach((value, index) => expect(value).toBeCloseTo(before.position[index] ?? Number.NaN, 9));
});

test("presets look from a side, and an orthographic picture has no vanishing point", async () => {
  const tab = await Tab.open(await use.context(), daemon.url);
  await tab.page.keyboard.press("x");
  const front = await camera(tab);
  expect(front.away[0] / front.distance).toBeCloseTo(1, 6);
  await tab.page.keyboard.press("Shift+X");
  const back = await camera(tab);
  expect(back.away[0] / back.distance).toBeCloseTo(-1, 6);
  await tab.page.keyboard.press("x");
  await camera(tab);
  const gap = async () => {
    const [near, far] = await Promise.all([tab.project([0.3, 0.2, 0.3]), tab.project([-3, 0.2, 0.3])]);
    return Math.hypot(near.x - far.x, near.y - far.y);
  };
  expect(await gap()).toBeGreaterThan(5);
  await tab.page.getByTestId("view-menu").click();
  await tab.page.getByTestId("orthographic").click();
  await tab.picture("orthographic-front");
  expect(await tab.violations()).toEqual([]);
  await camera(tab);
  expect(await gap()).toBeLessThan(0.01);
  await tab.page.getByTestId("view-top").click();
  const top = await camera(tab);
  expect(top.away[2] / top.distance).toBeCloseTo(1, 4);
  // A link under the pointer is found, and has its name beside it.
  await tab.page.keyboard.press("Escape");
  const points = await corners(resolve(REPOSITORY, "tests/assets/Bench_Arm-1.2 rev B/meshes/arm.STL"));
  const pose = await daemon.linkPose("bench_arm", "arm");
  const far = points.reduce((best, point) => ((point[0] ?? 0) > (best[0] ?? 0) ? point : best));
  const { x, y } = await tab.project(moved(pose, [0.85 * (far[0] ?? 0), far[1] ?? 0, 0]));
  await tab.page.mouse.move(x, y);
  await expect.poll(() => tab.page.locator(".scene-label:not([hidden])").allTextContents()).toEqual(["arm"]);
  await tab.picture("orthographic-top");
});

test("the camera moves with the robot that it follows", async () => {
  await daemon.simulation.setPhysics({ gravity: { x: 0, y: 0, z: 0 } });
  const ball = { geometry: { case: "sphere", value: { radius: 0.1 } } } as const;
  const put = (x: number, z: number) => ({ pose: { position: { x, y: 0, z }, orientation: { x: 0, y: 0, z: 0, w: 1 } } });
  await daemon.entities.spawnEntity({ name: "ball", base: Base.FREE, ...put(1, 1), source: { source: { case: "primitive", value: ball } } });
  const tab = await Tab.open(await use.context(), daemon.url);
  await tab.page.getByTestId("robot-ball").click();
  const go = async (x: number, z: number) => {
    await daemon.entities.setEntityState({ robot: "ball", ...put(x, z) });
    const { states } = await daemon.joints.getJointStates({});
    await tab.caughtUp(states?.stamp?.sequence ?? 0n);
    return (await camera(tab)).target;
  };
  const still = (await camera(tab)).target;
  (await go(2, 2)).forEach((value, index) => expect(value).toBeCloseTo(still[index] ?? Number.NaN, 6));
  await tab.page.keyboard.press("t");
  (await go(5, 1)).forEach((value, index) => expect(value).toBeCloseTo((still[index] ?? Number.NaN) + ([3, 0, -1][index] ?? 0), 3));
  await tab.page.keyboard.press("t");
  const left = (await camera(tab)).target;
  (await go(9, 9)).forEach((value, index) => expect(value).toBeCloseTo(left[index] ?? Number.NaN, 6));
});

test("a picture is saved at the requested size", async () => {
  const tab = await Tab.open(await use.context({ acceptDownloads: true }), daemon.url);
  await tab.page.keyboard.press("s");
  await tab.page.getByTestId("picture-width").fill("1000");
  await tab.page.getByTestId("picture-height").fill("1400");
  expect(await tab.violations()).toEqual([]);
  const [download] = await Promise.all([tab.page.waitForEvent("download"), tab.page.getByTestId("save-picture").click()]);
  const png = await readFile(await savedFile(download));
  expect([png.readUInt32BE(16), png.readUInt32BE(20)]).toEqual([1000, 1400]);
  // The picture has content: an empty one of one colour packs into some thousand bytes.
  expect(png.length).toBeGreaterThan(15_000);
  await tab.page.getByTestId("picture-sheet").waitFor({ state: "detached" });
  const canvas = await tab.page.getByTestId("viewport").evaluate((element: HTMLCanvasElement) => element.width / element.clientWidth);
  expect(canvas).toBeCloseTo(1, 2);
});

test("a copied link shows the same in another browser: camera, robot, layers and plots", async () => {
  await daemon.entities.spawnEntity({ name: "second", source: { source: { case: "urdf", value: new TextEncoder().encode(demoArm()) } }, base: Base.FIXED, pose: { position: { x: 0, y: 1.5, z: 0 } } });
  const context = await use.context({ permissions: ["clipboard-read", "clipboard-write"] });
  const tab = await Tab.open(context, daemon.url);
  await tab.page.getByTestId("robot-second").click();
  await tab.page.getByTestId("toggle-collision").click();
  await tab.page.getByTestId("plot-joint").first().click();
  await tab.page.evaluate(() => window.simd.camera.look([3, 1, 2], [0, 0.7, 0.2]));
  await camera(tab);
  await tab.page.getByTestId("view-menu").click();
  await tab.page.getByTestId("copy-link").click();
  await expect.poll(async () => (await tab.page.getByTestId("toast").allTextContents()).join()).toContain("The link is copied");
  const link = await tab.page.evaluate(() => navigator.clipboard.readText());
  const other = await Tab.open(await use.context(), link);
  const { position, target } = await camera(other);
  [...position, ...target].forEach((value, index) => expect(value).toBeCloseTo([3, 1, 2, 0, 0.7, 0.2][index] ?? NaN, 3));
  expect(await other.page.getByTestId("robot-second").getAttribute("aria-selected")).toBe("true");
  expect(await other.page.getByTestId("toggle-collision").getAttribute("aria-pressed")).toBe("true");
  await other.page.getByTestId("plot").first().waitFor();
  expect(new URL(other.page.url()).hash).toBe("");
  await other.picture("link");
});
