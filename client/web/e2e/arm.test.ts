// The demo robot in a real browser: the picture shows the simulation.

import { resolve } from "node:path";

import type { BrowserContext } from "playwright-core";
import { beforeEach, expect, test } from "vitest";

import { SimulationState } from "../src/gen/simd/v1/simulation_pb";
import { type Bounds, bounds, Tab } from "./browser";
import { Daemon, REPOSITORY } from "./daemon";
import { corners, moved } from "./mesh";
import { fixtures } from "./fixtures";

const MESH = resolve(REPOSITORY, "tests/assets/Bench_Arm-1.2 rev B/meshes/arm.STL");
/** The arm is orange: rgb 0.96 0.52 0.12 has a hue of 29 degrees. */
const ORANGE = [18, 42] as const;
/** Maximum distance in pixels of the picture from the daemon's pose. */
const CLOSE = 5;

const use = fixtures();
let context: BrowserContext;
let daemon: Daemon;

beforeEach(async () => {
  context = await use.context({ acceptDownloads: true });
  daemon = await use.daemon(Daemon.demo());
});

/** Returns the box around the arm in the picture that the daemon's link pose predicts. */
async function expected(tab: Tab): Promise<Bounds> {
  const pose = await daemon.linkPose("bench_arm", "arm");
  const world = (await corners(MESH)).map((corner) => moved(pose, corner));
  return bounds(await tab.page.evaluate((all) => all.map((point) => window.simd.project(point)), world));
}

/** Checks that the picture agrees with the daemon: each side of the box around the arm is close. */
async function agrees(tab: Tab): Promise<Bounds> {
  const sequence = (await daemon.joints.getJointStates({})).states?.stamp?.sequence ?? 0n;
  await tab.caughtUp(sequence);
  const where = await expected(tab);
  const around = { left: where.left - 40, right: where.right + 40, top: where.top - 40, bottom: where.bottom + 40 };
  const { box, pixels } = await tab.seen(around, ...ORANGE);
  expect(pixels, "pixels of the arm's colour").toBeGreaterThan(300);
  for (const side of ["left", "right", "top", "bottom"] as const) {
    expect(Math.abs(box[side] - where[side]), `${side} of ${JSON.stringify({ box, where })}`).toBeLessThan(CLOSE);
  }
  return box;
}

/** Waits until the daemon reports that the shoulder is at rest at its target. */
async function arrived(): Promise<number> {
  for (;;) {
    const { position, velocity, target } = await daemon.joint("bench_arm", "shoulder");
    if (Math.abs(position - target) < 2e-3 && Math.abs(velocity) < 1e-3) return position;
  }
}

test("the arm is seen where the daemon says, before and after its slider is dragged", async () => {
  const tab = await Tab.open(context, daemon.url);
  const before = await agrees(tab);
  await tab.picture("bench-arm");
  const slider = tab.page.getByTestId("slider").first();
  const box = await slider.boundingBox();
  if (box === null) throw new Error("the slider is not there");
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  await tab.page.mouse.move(x, y);
  await tab.page.mouse.down();
  await tab.page.mouse.move(x + box.width / 8, y, { steps: 8 });
  await tab.page.mouse.up();
  await expect.poll(async () => (await daemon.joint("bench_arm", "shoulder")).target).not.toBe(0);
  const position = await arrived();
  // An eighth of a slider that is a turn wide.
  expect(Math.abs(position)).toBeGreaterThan(0.5);
  expect(Math.abs(position)).toBeLessThan(1.1);
  const after = await agrees(tab);
  expect(Math.max(Math.abs(after.top - before.top), Math.abs(after.bottom - before.bottom))).toBeGreaterThan(30);
  await tab.picture("bench-arm-moved");
});

test("pause and step are the daemon's", async () => {
  const tab = await Tab.open(context, daemon.url);
  const state = async () => (await daemon.simulation.getSimulationState({})).state;
  const step = async () => (await daemon.simulation.getSimulationState({})).stamp?.step ?? 0n;
  await tab.page.getByTestId("play").click();
  await expect.poll(state).toBe(SimulationState.PAUSED);
  const before = await step();
  await tab.page.getByTestId("step").click();
  await expect.poll(step).toBe(before + 1n);
  await tab.page.keyboard.press(".");
  await expect.poll(step).toBe(before + 2n);
  await tab.page.waitForFunction((least) => (window.simd.frame()?.step ?? 0n) === BigInt(least), String(before + 2n));
  await tab.page.keyboard.press("Space");
  await expect.poll(state).toBe(SimulationState.PLAYING);
  // The client of this test is connected too.
  daemon.stays();
  await tab.page.getByTestId("reset").click();
  await tab.page.getByTestId("ask-surely").click();
  await expect.poll(async () => (await daemon.simulation.getSimulationState({})).stamp?.epoch).toBeGreaterThan(0n);
});

test("a typed value with its unit is the joint's target, and what cannot be read is quoted", async () => {
  const tab = await Tab.open(context, daemon.url);
  const number = tab.page.getByTestId("number").first();
  await number.fill("2*0.3 foo");
  await number.press("Enter");
  await expect.poll(async () => (await tab.page.getByTestId("toast").allTextContents()).join()).toContain('"foo" in "2*0.3 foo"');
  expect(await number.getAttribute("aria-invalid")).toBe("true");
  expect((await daemon.joint("bench_arm", "shoulder")).target).toBe(0);
  await number.fill("2 * (0.1 + 0.2) rad");
  await number.press("Enter");
  await expect.poll(async () => (await daemon.joint("bench_arm", "shoulder")).target).toBeCloseTo(0.6, 9);
  await number.fill("30 deg");
  await number.press("Enter");
  await expect.poll(async () => (await daemon.joint("bench_arm", "shoulder")).target).toBeCloseTo(Math.PI / 6, 6);
});

test("a change of mode does not jerk: the new target starts from what the joint does", async () => {
  const tab = await Tab.open(context, daemon.url);
  await daemon.aim("bench_arm", { shoulder: 0.4 });
  const position = await arrived();
  await tab.page.waitForFunction((least) => Math.abs((window.simd.frame()?.joints.get("bench_arm")?.position[0] ?? 0) - least) < 1e-3, position);
  await tab.page.getByTestId("mode").first().selectOption("velocity");
  await expect.poll(async () => (await daemon.joint("bench_arm", "shoulder")).mode).toBe(3);
  const { velocity, target } = await daemon.joint("bench_arm", "shoulder");
  expect(Math.abs(target)).toBeLessThan(0.01);
  expect(Math.abs(velocity)).toBeLessThan(0.05);
});

test("targets of other clients move the slider", async () => {
  const tab = await Tab.open(context, daemon.url);
  await daemon.aim("bench_arm", { shoulder: -0.8 });
  await expect.poll(() => tab.page.getByTestId("number").first().inputValue()).toContain("-0.8");
  await expect.poll(() => tab.page.getByTestId("joint-row-bench_arm/shoulder").textContent()).toContain("test");
});

test("a reload keeps the unit, the plotted joints and the camera, also while the robot moves and where the pointer rests before it drags", async () => {
  const tab = await Tab.open(context, daemon.url);
  await tab.page.getByTestId("deg").click();
  await tab.page.getByTestId("plot-joint").first().click();
  await tab.page.getByTestId("plots").waitFor();
  const box = await tab.page.getByTestId("viewport").boundingBox();
  if (box === null) throw new Error("the view has no size");
  await daemon.joints.setJointTargets({ robots: [{ robot: "bench_arm", joints: [{ joint: "shoulder", target: { case: "velocity", value: { velocity: 1 } } }] }] });
  const camera = () => tab.page.evaluate(() => [...window.simd.camera.position(), ...window.simd.camera.target()]);
  const before = await camera();
  await tab.page.mouse.move(box.x + 20, box.y + 20);
  await tab.page.mouse.down();
  const pictures = await tab.page.evaluate(() => window.simd.stats.pictures());
  await tab.page.waitForFunction((from) => window.simd.stats.pictures() > from + 3, pictures);
  await tab.page.mouse.move(box.x + 140, box.y + 60, { steps: 8 });
  await tab.page.mouse.up();
  const distance = (a: number[], b: number[]) => Math.hypot(...a.map((value, index) => value - (b[index] ?? Number.NaN)));
  const stored = () => tab.page.evaluate(() => (JSON.parse(sessionStorage.getItem("simd.view.camera") ?? "[]") as number[][]).flat());
  await expect.poll(async () => distance(before, await stored()) > 0.1).toBe(true);
  // The camera may still be moving: the stored view counts, written as the page closes.
  await tab.page.addInitScript(() => {
    const kept = sessionStorage.getItem("simd.view.camera");
    sessionStorage.setItem("kept", sessionStorage.getItem("kept") ?? kept ?? "[]");
  });
  await tab.page.reload();
  await tab.page.waitForFunction(() => window.simd?.frame() != null && window.simd.settled());
  const kept = await tab.page.evaluate(() => (JSON.parse(sessionStorage.getItem("kept") ?? "[]") as number[][]).flat());
  (await camera()).forEach((value, index) => expect(value).toBeCloseTo(kept[index] ?? Number.NaN, 4));
  expect(await tab.page.getByTestId("deg").getAttribute("aria-pressed")).toBe("true");
  expect(await tab.page.getByTestId("plot-joint").first().getAttribute("aria-pressed")).toBe("true");
  await tab.picture("view-kept");
});

test("a plot on a narrow page can be zoomed", async () => {
  const narrow = await use.context({ viewport: { width: 700, height: 900 } });
  const tab = await Tab.open(narrow, daemon.url);
  if (!(await tab.page.getByTestId("plots").isVisible())) await tab.page.keyboard.press("p");
  const plot = tab.page.getByTestId("plot-position");
  await plot.waitFor();
  await tab.page.waitForFunction(() => (window.simd.frame()?.simTime ?? 0) > 1);
  /** Coloured pixels belong to the line; the grid and the labels are grey. */
  const coloured = () =>
    plot.locator("canvas").evaluate((canvas: HTMLCanvasElement) => {
      const data = canvas.getContext("2d")?.getImageData(0, 0, canvas.width, canvas.height).data ?? [];
      let count = 0;
      for (let at = 0; at < data.length; at += 4) {
        const [red = 0, green = 0, blue = 0, alpha = 0] = [data[at], data[at + 1], data[at + 2], data[at + 3]];
        if (alpha > 100 && Math.max(red, green, blue) - Math.min(red, green, blue) > 60) count += 1;
      }
      return count;
    });
  await expect.poll(coloured).toBeGreaterThan(50);
  const box = await plot.boundingBox();
  if (box === null) throw new Error("the plot has no size");
  await tab.page.mouse.move(box.x + 70, box.y + box.height / 2);
  await tab.page.mouse.down();
  await tab.page.mouse.move(box.x + 70 + box.width / 3, box.y + box.height / 2, { steps: 5 });
  await tab.page.mouse.up();
  await expect.poll(() => tab.page.getByTestId("zoom-out").isEnabled()).toBe(true);
  await tab.page.waitForFunction((from) => window.simd.stats.frames() > from + 10, await tab.page.evaluate(() => window.simd.stats.frames()));
  await expect.poll(coloured).toBeGreaterThan(50);
});

test("a plot draws the joint, and its figures can be saved", async () => {
  const tab = await Tab.open(context, daemon.url);
  if (!(await tab.page.getByTestId("plot").first().isVisible())) await tab.page.keyboard.press("p");
  const number = tab.page.getByTestId("number").first();
  await number.fill("1");
  await number.press("Enter");
  await arrived();
  const drawn = () =>
    tab.page.evaluate(() => {
      const canvas = document.querySelector<HTMLCanvasElement>("[data-testid=plot] canvas");
      const context = canvas?.getContext("2d");
      if (canvas == null || context == null) return 0;
      const { data } = context.getImageData(0, 0, canvas.width, canvas.height);
      const colours = new Set<number>();
      for (let at = 0; at < data.length; at += 4) {
        if ((data[at + 3] ?? 0) > 200) colours.add(((data[at] ?? 0) << 16) | ((data[at + 1] ?? 0) << 8) | (data[at + 2] ?? 0));
      }
      return colours.size;
    });
  await expect.poll(drawn).toBeGreaterThan(3);
  await tab.picture("plot");
  const [download] = await Promise.all([tab.page.waitForEvent("download"), tab.page.getByTestId("csv").first().click()]);
  const chunks = [];
  for await (const chunk of await download.createReadStream()) chunks.push(chunk as Buffer);
  const rows = Buffer.concat(chunks).toString("utf8").trim().split("\n");
  expect(rows[0]).toMatch(/^"?sim_time/);
  expect(rows[0]).toContain("shoulder.position");
  // The file has a row for each state that a slow page has seen.
  expect(rows.length).toBeGreaterThan(5);
  const last = (rows.at(-1) ?? "").split(",").map(Number);
  expect(last[1]).toBeCloseTo(1, 1);
});
