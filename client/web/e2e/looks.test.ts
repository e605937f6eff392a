// Appearance of robots: pictures on meshes and shapes, from the daemon's disk and from the page; and the resolution of the picture.

import { cp, mkdir, mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";

import { expect, test } from "vitest";

import { Base } from "../src/gen/simd/v1/entity_pb";
import { Tab } from "./browser";
import { Daemon, REPOSITORY } from "./daemon";
import { fixtures } from "./fixtures";

const use = fixtures();
/** A picture of high quality takes the processor seconds: tests use as few pixels as possible. */
const SMALL = { viewport: { width: 640, height: 360 } };

const ASSETS = resolve(REPOSITORY, "tests/assets");
/** Metres: half of a side of the boxes, and the middle of a quarter of a side. */
const HALF = 0.1;
const QUARTER = 0.05;
const HEIGHT = 0.5;

type Colour = "red" | "green" | "blue" | "yellow" | "none";

/** Returns the colours of points of the world on the page. */
async function colours(tab: Tab, points: number[][]): Promise<Colour[]> {
  const places = await Promise.all(points.map((point) => tab.project(point)));
  const png = (await tab.screenshot()).toString("base64");
  const pixels = await tab.page.evaluate(
    async ({ png, places }) => {
      const bytes = Uint8Array.from(atob(png), (letter) => letter.charCodeAt(0));
      const image = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
      const drawing = new OffscreenCanvas(image.width, image.height).getContext("2d", { willReadFrequently: true });
      if (drawing === null) throw new Error("no canvas");
      drawing.drawImage(image, 0, 0);
      return places.map(({ x, y }) => [...drawing.getImageData(Math.round(x), Math.round(y), 1, 1).data]);
    },
    { png, places },
  );
  return pixels.map(([red = 0, green = 0, blue = 0]) => {
    const most = Math.max(red, green, blue);
    const [r, g, b] = [red, green, blue].map((part) => part > 0.6 * most);
    if (most < 40 || Math.min(red, green, blue) > 0.7 * most) return "none";
    if (r && g) return "yellow";
    return r ? "red" : g ? "green" : b ? "blue" : "none";
  });
}

/** The quarters of a box's side towards x, in reading order: upper left, upper right, lower left, lower right. */
function quarters(y: number): number[][] {
  return [QUARTER, -QUARTER].flatMap((z) => [-QUARTER, QUARTER].map((across) => [HALF, y + across, HEIGHT + z]));
}

async function look(tab: Tab): Promise<void> {
  await tab.page.evaluate((height) => window.simd.camera.look([2.2, 0, height], [0, 0, height]), HEIGHT);
  await tab.page.waitForFunction(() => window.simd.settled());
}

test("a picture is on each side of a box as its mesh says, in each format, and on a shape", async () => {
  const daemon = await use.daemon(Daemon.start(["--paused", "--asset-root", ASSETS]));
  const kinds = ["dae", "obj", "glb", "gltf", "shape"];
  const across = (n: number) => 0.25 * (n - 2);
  for (const [n, kind] of kinds.entries()) {
    const pose = { position: { x: 0, y: across(n), z: HEIGHT } };
    const source = { source: { case: "path", value: resolve(ASSETS, `textured/urdf/${kind}.urdf`) } } as const;
    const { report } = await daemon.entities.spawnEntity({ name: kind, base: Base.FIXED, pose, source });
    expect(report?.findings.filter(({ message }) => message.includes("not found") || message.includes("not read"))).toEqual([]);
  }
  const tab = await Tab.open(await use.context(), daemon.url);
  await look(tab);
  await tab.picture("textures");
  for (const [n, kind] of kinds.entries()) {
    const seen = await colours(tab, quarters(across(n)));
    if (kind === "shape") expect([...seen].sort()).toEqual(["blue", "green", "red", "yellow"]);
    else expect(seen, kind).toEqual(["red", "green", "blue", "yellow"]);
  }
  expect(tab.consoleMessages).toEqual([]);
});

test("a folder that is dropped on the page brings its pictures along", async () => {
  const daemon = await use.daemon(Daemon.start(["--paused"]));
  const folder = await mkdtemp(join(tmpdir(), "simd-looks-"));
  try {
    for (const part of ["meshes", "pictures"]) await cp(resolve(ASSETS, "textured", part), join(folder, part), { recursive: true });
    await mkdir(join(folder, "urdf"));
    await cp(resolve(ASSETS, "textured/urdf/obj.urdf"), join(folder, "urdf/box.urdf"));
    const tab = await Tab.open(await use.context(), daemon.url);
    await tab.page.getByTestId("folder-input").first().setInputFiles(folder);
    await tab.page.getByTestId("load-now").click();
    await expect.poll(async () => (await daemon.entities.listEntities({})).entities.map(({ name }) => name)).toEqual(["box"]);
    await daemon.entities.setEntityState({ robot: "box", pose: { position: { x: 0, y: 0, z: HEIGHT }, orientation: { x: 0, y: 0, z: 0, w: 1 } } });
    await look(tab);
    await expect.poll(() => colours(tab, quarters(0))).toEqual(["red", "green", "blue", "yellow"]);
    expect(tab.consoleMessages).toEqual([]);
  } finally {
    await rm(folder, { recursive: true });
  }
});

test("materials of MJCF and SDF have their pictures too, on shapes and on meshes", async () => {
  const daemon = await use.daemon(Daemon.start(["--paused", "--asset-root", ASSETS]));
  const kinds = ["mesh.xml", "mesh.sdf", "shape.xml", "shape.sdf"];
  const across = (n: number) => 0.25 * (n - 1.5);
  for (const [n, kind] of kinds.entries()) {
    const pose = { position: { x: 0, y: across(n), z: HEIGHT } };
    const source = { source: { case: "path", value: resolve(ASSETS, `textured/models/${kind}`) } } as const;
    await daemon.entities.spawnEntity({ name: kind.replace(".", "_"), base: Base.FIXED, pose, source });
  }
  const tab = await Tab.open(await use.context(), daemon.url);
  await look(tab);
  await tab.picture("textures-models");
  for (const [n, kind] of kinds.entries()) {
    const seen = await colours(tab, quarters(across(n)));
    if (kind.startsWith("shape")) expect([...seen].sort(), kind).toEqual(["blue", "green", "red", "yellow"]);
    else expect(seen, kind).toEqual(["red", "green", "blue", "yellow"]);
  }
  expect(tab.consoleMessages).toEqual([]);
});

test("ground of MJCF has the pattern that MuJoCo makes for it, as often as its material says", async () => {
  const daemon = await use.daemon(Daemon.start(["--paused"]));
  const mjcf = new TextEncoder().encode(
    `<mujoco model="scene"><asset><texture name="grid" type="2d" builtin="checker" rgb1="1 0 0" rgb2="0 0 1" width="64" height="64"/>` +
      `<material name="floor" texture="grid" texrepeat="2 1" texuniform="true"/></asset>` +
      `<worldbody><geom type="plane" size="0 0 1" material="floor"/></worldbody></mujoco>`,
  );
  await daemon.entities.spawnEntity({ name: "scene", source: { source: { case: "urdf", value: mjcf } } });
  const tab = await Tab.open(await use.context(), daemon.url);
  await tab.page.keyboard.press("g");
  await tab.page.evaluate(() => window.simd.camera.look([0, -0.01, 8], [0, 0, 0]));
  await tab.page.waitForFunction(() => window.simd.settled());
  await tab.picture("texture-repeat");
  // Two metres over the number are four fields: fields of half a metre along x, and of one along y. As in MuJoCo, the middle of a
  // picture is at the origin, and its upper left has the first colour.
  for (let x = -1.25; x < 1.5; x += 0.5) {
    for (let y = -1.5; y < 2; y += 1) {
      const [column, row] = [Math.floor(x / 0.5), Math.floor(y / 1)];
      expect(await colours(tab, [[x, y, 0]]), `${x} ${y}`).toEqual([(column + row) % 2 === 0 ? "blue" : "red"]);
    }
  }
});

/** Returns the brightness of points of the world on the page, 0 to 255. */
async function brightness(tab: Tab, points: number[][]): Promise<number[]> {
  const places = await Promise.all(points.map((point) => tab.project(point)));
  const png = (await tab.screenshot()).toString("base64");
  return tab.page.evaluate(
    async ({ png, places }) => {
      const bytes = Uint8Array.from(atob(png), (letter) => letter.charCodeAt(0));
      const image = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
      const drawing = new OffscreenCanvas(image.width, image.height).getContext("2d", { willReadFrequently: true });
      if (drawing === null) throw new Error("no canvas");
      drawing.drawImage(image, 0, 0);
      // The mean of a few pixels: the picture has noise.
      return places.map(({ x, y }) => {
        const { data } = drawing.getImageData(Math.round(x) - 1, Math.round(y) - 1, 3, 3);
        return data.filter((_, index) => index % 4 !== 3).reduce((sum, part) => sum + part, 0) / 27;
      });
    },
    { png, places },
  );
}

test("at high quality gaps are darker than what lies open, and without the code for it they are as bright", async () => {
  const daemon = await use.daemon(Daemon.start(["--paused"]));
  // Two boxes that stand a hand apart, on a third.
  for (const [name, size, y, z] of [["floor", { x: 2, y: 2, z: 0.1 }, 0, -0.05], ["left", { x: 0.4, y: 0.4, z: 0.4 }, -0.25, 0.2], ["right", { x: 0.4, y: 0.4, z: 0.4 }, 0.25, 0.2]] as const) {
    const primitive = { geometry: { case: "box", value: { size } }, mass: 1, color: { red: 0.8, green: 0.8, blue: 0.8, alpha: 1 } } as const;
    await daemon.entities.spawnEntity({ name, base: Base.FIXED, pose: { position: { x: 0, y, z } }, source: { source: { case: "primitive", value: primitive } } });
  }
  // The wall of a box, at its foot and higher up.
  const seen = async (tab: Tab) => {
    await tab.page.evaluate(() => window.simd.camera.look([1.6, 0.3, 0.9], [0, 0, 0.1]));
    await tab.page.waitForFunction(() => window.simd.settled());
    const [gap = 0, open = 0] = await brightness(tab, [[0.2, -0.25, 0.02], [0.2, -0.25, 0.25]]);
    return { gap, open };
  };
  const opened = async (without: boolean): Promise<Tab> => {
    const context = await use.context(SMALL);
    await context.addInitScript(() => localStorage.setItem("simd.view.quality", JSON.stringify("high")));
    if (without) await context.route(/ambient-occlusion-.*\.js$/, (route) => route.abort());
    return Tab.open(context, daemon.url);
  };
  const [dark, plain] = [await opened(false), await opened(true)];
  const [with_, none] = [await seen(dark), await seen(plain)];
  await dark.picture("occlusion-on");
  await plain.picture("occlusion-off");
  expect([await dark.page.evaluate(() => window.simd.occlusion()), await plain.page.evaluate(() => window.simd.occlusion())]).toEqual([true, false]);
  expect(with_.gap, JSON.stringify({ with_, none })).toBeLessThan(0.9 * none.gap);
  expect(Math.abs(with_.open - none.open), JSON.stringify({ with_, none })).toBeLessThan(0.03 * none.open);
  expect(dark.consoleMessages).toEqual([]);
});

test("a graphics context that was lost and comes back has the light of the room again", async () => {
  const daemon = await use.daemon(Daemon.start(["--paused"]));
  const primitive = { geometry: { case: "box", value: { size: { x: 1, y: 1, z: 1 } } }, mass: 1, color: { red: 0.8, green: 0.8, blue: 0.8, alpha: 1 } } as const;
  await daemon.entities.spawnEntity({ name: "box", base: Base.FIXED, pose: { position: { x: 0, y: 0, z: 0.5 } }, source: { source: { case: "primitive", value: primitive } } });
  const context = await use.context(SMALL);
  await context.addInitScript(() => localStorage.setItem("simd.view.quality", JSON.stringify("high")));
  const tab = await Tab.open(context, daemon.url);
  // The side away from the sun.
  const seen = async (): Promise<number> => {
    await tab.page.evaluate(() => window.simd.camera.look([-2.2, -1, 0.8], [0, 0, 0.5]));
    await tab.page.waitForFunction(() => window.simd.settled());
    return (await brightness(tab, [[-0.5, 0, 0.6]]))[0] ?? 0;
  };
  const before = await seen();
  const said = await tab.page.evaluate(async () => {
    const canvas = document.querySelector<HTMLCanvasElement>(".viewport canvas");
    const loss = canvas?.getContext("webgl2")?.getExtension("WEBGL_lose_context");
    if (!canvas || !loss) throw new Error("there is no context");
    const happened = (name: string) => new Promise((resolve) => canvas.addEventListener(name, resolve, { once: true }));
    const lost = happened("webglcontextlost");
    loss.loseContext();
    await lost;
    // A context can be restored once its event is over; the next frame shows the message.
    await new Promise((resolve) => requestAnimationFrame(() => setTimeout(resolve)));
    const box = canvas.getBoundingClientRect();
    const seen = document.elementFromPoint(box.left + box.width / 2, box.top + 0.44 * box.height)?.textContent;
    const restored = happened("webglcontextrestored");
    loss.restoreContext();
    await restored;
    return seen;
  });
  expect(said).toContain("stopped the graphics");
  expect(await tab.page.getByTestId("viewport-problem").count()).toBe(0);
  await expect.poll(async () => Math.abs((await seen()) - before)).toBeLessThan(0.03 * before);
  await tab.picture("context-restored");
});

test("the picture has the colour of its background before the first state arrives", async () => {
  const daemon = await use.daemon(Daemon.start(["--paused"]));
  const context = await use.context(SMALL);
  // No call is answered.
  await context.route("**/simd.v1.*/*", () => undefined);
  const tab = await Tab.load(context, daemon.url);
  const [middle = 0] = await brightness(tab, [[0, 0, 0]]);
  expect(middle).toBeGreaterThan(200);
});

test("the quality is that of the machine until it is chosen, and is kept", async () => {
  const daemon = await use.daemon(Daemon.demo());
  const context = await use.context(SMALL);
  const tab = await Tab.open(context, daemon.url);
  const quality = () => tab.page.evaluate(() => window.simd.quality());
  // The browser of these tests draws without a graphics processor.
  expect(await quality()).toBe("low");
  const smooths = () => tab.page.getByTestId("viewport").evaluate((canvas: HTMLCanvasElement) => canvas.getContext("webgl2")?.getContextAttributes()?.antialias);
  expect(await smooths()).toBe(false);
  await tab.page.getByTestId("view-menu").click();
  await tab.page.getByTestId("quality-high").click();
  await expect.poll(quality).toBe("high");
  await tab.page.waitForFunction(() => window.simd.settled());
  for (const chunk of [/environment-.*\.js$/, /ambient-occlusion-.*\.js$/]) expect(tab.requests.filter(({ pathname }) => chunk.test(pathname)).length).toBe(1);
  expect(await tab.violations()).toEqual([]);
  await tab.picture("quality-high");
  await tab.page.reload();
  await expect.poll(quality).toBe("high");
  await tab.page.getByTestId("view-menu").click();
  await tab.page.getByTestId("quality-low").click();
  await expect.poll(quality).toBe("low");
  await tab.page.waitForFunction(() => window.simd.settled());
  await tab.picture("quality-low");
  expect(tab.consoleMessages).toEqual([]);
});
