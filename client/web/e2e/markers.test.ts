// Markers, cameras, keys and mouse: programs draw in the page, move its camera, and receive its input.

import { expect, test } from "vitest";

import { Base } from "../src/gen/simd/v1/entity_pb";
import { MouseButton } from "../src/gen/simd/v1/view_pb";
import { Tab } from "./browser";
import { Daemon } from "./daemon";
import { fixtures } from "./fixtures";

const use = fixtures();

/** Rounds to a tenth of a millimetre, without the sign of a zero: points are single precision. */
function rounded(points: number[][] | undefined): number[][] | undefined {
  return points?.map((point) => point.map((value) => Math.round(1e4 * value) / 1e4 || 0));
}

const RED = { red: 1, green: 0.1, blue: 0, alpha: 1 };

test("lines, points and texts are drawn at their places, move with their link, and disappear", async () => {
  const daemon = await use.daemon(Daemon.start(["--paused"]));
  const sphere = { geometry: { case: "sphere", value: { radius: 0.1 } }, mass: 1 } as const;
  await daemon.entities.spawnEntity({ name: "ball", base: Base.FIXED, pose: { position: { x: 0, y: 0, z: 0.5 } }, source: { source: { case: "primitive", value: sphere } } });
  const { ids } = await daemon.view.addMarkers({
    markers: [
      { shape: { case: "lines", value: { points: [-0.5, 0, 1, 0.5, 0, 1], width: 8 } }, color: RED },
      { shape: { case: "points", value: { points: [0, 0, 0.3], size: 12, colors: [1, 0.1, 0] } }, robot: "ball" },
      { shape: { case: "text", value: { text: "here", position: { x: 0, y: 0, z: 1.2 }, size: 0.15 } }, color: RED },
      { shape: { case: "text", value: { text: "upright", orientation: { x: 0.7071, y: 0, z: 0, w: 0.7071 }, size: 0.15 } } },
    ],
  });
  const [line = 0n, dot = 0n, text = 0n] = ids;
  const tab = await Tab.open(await use.context(), daemon.url);
  const drawn = async (id: bigint) => rounded(await tab.page.evaluate((it) => window.simd.marker(BigInt(it)), id.toString()));
  await expect.poll(() => drawn(line)).toEqual([[-0.5, 0, 1], [0.5, 0, 1]]);
  await daemon.view.setCamera({ position: { x: 0, y: -3, z: 0.8 }, target: { x: 0, y: 0, z: 0.8 } });
  await expect.poll(async () => rounded([await tab.page.evaluate(() => window.simd.camera.position())])).toEqual([[0, -3, 0.8]]);
  expect(await drawn(dot)).toEqual([[0, 0, 0.8]]);
  // The line has its stated length and width on the page.
  const [from, to] = [await tab.project([-0.5, 0, 1]), await tab.project([0.5, 0, 1])];
  const around = { left: from.x - 40, right: to.x + 40, top: from.y - 15, bottom: from.y + 15 };
  const red = () => tab.seen(around, 0, 30);
  await expect.poll(async () => (await red()).pixels).toBeGreaterThan(0);
  const { box } = await red();
  expect(Math.abs(box.left - from.x)).toBeLessThan(10);
  expect(Math.abs(box.right - to.x)).toBeLessThan(10);
  expect(box.bottom - box.top).toBeGreaterThanOrEqual(6);
  expect(box.bottom - box.top).toBeLessThanOrEqual(11);
  const words = await tab.project([0, 0, 1.2]);
  expect((await tab.seen({ left: words.x - 2, right: words.x + 120, top: words.y - 60, bottom: words.y + 2 }, 0, 30)).pixels).toBeGreaterThan(50);
  await tab.picture("markers");
  expect(await tab.violations()).toEqual([]);

  await daemon.entities.setEntityState({ robot: "ball", pose: { position: { x: 1, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } } });
  await expect.poll(() => drawn(dot)).toEqual([[1, 0, 0.3]]);
  const upright = (lifeTime: number) => ({ id: line, shape: { case: "lines" as const, value: { points: [0, 0, 0, 0, 0, 2], width: 1 } }, lifeTime });
  await daemon.view.addMarkers({ markers: [upright(0)] });
  await expect.poll(() => drawn(line)).toEqual([[0, 0, 0], [0, 0, 2]]);
  await daemon.view.addMarkers({ markers: [upright(0.2)] });
  await expect.poll(() => drawn(line)).toBeUndefined();
  await daemon.entities.deleteEntity({ robot: "ball" });
  await expect.poll(() => drawn(dot)).toBeUndefined();
  expect(await drawn(text)).toBeDefined();
  await tab.page.keyboard.press("d");
  await expect.poll(() => drawn(text)).toBeUndefined();
  await tab.page.keyboard.press("d");
  await daemon.view.deleteMarkers({});
  await expect.poll(() => drawn(text)).toBeUndefined();
  expect(tab.consoleMessages).toEqual([]);
});

test("a link is drawn in the colour that a program gives it, and in its own again", async () => {
  const daemon = await use.daemon(Daemon.start(["--paused"]));
  const sphere = { geometry: { case: "sphere", value: { radius: 0.3 } }, mass: 1, color: { red: 0, green: 0.2, blue: 1, alpha: 1 } } as const;
  await daemon.entities.spawnEntity({ name: "ball", base: Base.FIXED, pose: { position: { x: 0, y: 0, z: 0.5 } }, source: { source: { case: "primitive", value: sphere } } });
  const tab = await Tab.open(await use.context(), daemon.url);
  await daemon.view.setCamera({ position: { x: 0, y: -3, z: 0.5 }, target: { x: 0, y: 0, z: 0.5 } });
  await expect.poll(async () => rounded([await tab.page.evaluate(() => window.simd.camera.position())])).toEqual([[0, -3, 0.5]]);
  const middle = await tab.project([0, 0, 0.5]);
  const around = { left: middle.x - 20, right: middle.x + 20, top: middle.y - 20, bottom: middle.y + 20 };
  const red = async () => (await tab.seen(around, 0, 30)).pixels;
  expect(await red()).toBe(0);
  await daemon.view.setLinkColors({ colors: [{ robot: "ball", link: "link", color: RED }] });
  await expect.poll(red).toBeGreaterThan(500);
  await daemon.view.setLinkColors({ colors: [{ robot: "ball", link: "link" }] });
  await expect.poll(red).toBe(0);
  expect(tab.consoleMessages).toEqual([]);
});

test("the page says where its camera is, and follows one that is set, also when it is opened later", async () => {
  const daemon = await use.daemon(Daemon.demo());
  const tab = await Tab.open(await use.context(), daemon.url);
  const first = async () => (await daemon.view.getCameras({})).cameras[0];
  // The camera is fitted to the robot, but the reported one may still be the old one.
  const [x] = await tab.page.evaluate(() => window.simd.camera.position());
  await expect.poll(async () => (await first())?.camera?.position?.x).toBeCloseTo(x, 3);
  const begin = (await first())?.camera?.position;
  expect((await first())?.camera?.width).toBeGreaterThan(100);
  // The user moves it.
  const box = (await tab.page.getByTestId("viewport").boundingBox()) ?? { x: 0, y: 0, width: 0, height: 0 };
  await tab.page.mouse.move(box.x + 20, box.y + 100);
  await tab.page.mouse.down();
  await tab.page.mouse.move(box.x + 220, box.y + 100, { steps: 5 });
  await tab.page.mouse.up();
  // Over the whole distance: along one axis it may end about where it began.
  const moved = async (): Promise<number> => {
    const now = (await first())?.camera?.position;
    return Math.hypot((now?.x ?? 0) - (begin?.x ?? 0), (now?.y ?? 0) - (begin?.y ?? 0), (now?.z ?? 0) - (begin?.z ?? 0));
  };
  await expect.poll(moved).toBeGreaterThan(0.1);

  const wanted = { position: { x: 2, y: 1, z: 1.5 }, target: { x: 0, y: 0, z: 0.25 }, fieldOfView: Math.PI / 2 };
  const { version } = await daemon.view.setCamera(wanted);
  await expect.poll(async () => (await first())?.followedVersion).toBe(version);
  const seen = (await first())?.camera;
  for (const [name, value] of Object.entries(wanted.position)) expect(seen?.position?.[name as "x"]).toBeCloseTo(value, 6);
  expect(seen?.fieldOfView).toBeCloseTo(Math.PI / 2, 9);
  await tab.page.close();
  await expect.poll(async () => (await daemon.view.getCameras({})).cameras.length).toBe(0);
  const later = await Tab.open(await use.context(), daemon.url);
  await expect.poll(async () => rounded([await later.page.evaluate(() => window.simd.camera.position())])).toEqual([[2, 1, 1.5]]);
});

test("keys and mouse go to the program that asks for them, and else to the page", async () => {
  const daemon = await use.daemon(Daemon.demo());
  const tab = await Tab.open(await use.context(), daemon.url);
  const { page } = tab;
  const grid = () => page.getByTestId("toggle-grid").getAttribute("aria-pressed");
  const before = await grid();
  const keys: unknown[] = [];
  const buttons: unknown[] = [];
  // Asks without a break: five seconds after the last request the keys are the page's again.
  let asking = true;
  const asked = (async () => {
    let { sequence } = await daemon.view.nextInput({});
    while (asking) {
      const answer = await daemon.view.nextInput({ afterSequence: sequence, timeout: 0.5 });
      sequence = answer.sequence;
      for (const { kind, client } of answer.events) {
        expect(client).toMatch(/^viewer-/);
        if (kind.case === "key") keys.push([kind.value.key, kind.value.code, kind.value.isDown]);
        if (kind.case === "mouse" && kind.value.button === MouseButton.LEFT) buttons.push([Math.round(kind.value.x), Math.round(kind.value.y), kind.value.isDown]);
      }
    }
  })();
  await page.getByTestId("input-note").waitFor();
  expect(await page.getByTestId("input-note").textContent()).toContain("test");
  const box = (await page.getByTestId("viewport").boundingBox()) ?? { x: 0, y: 0, width: 0, height: 0 };
  await page.keyboard.down("g");
  await page.keyboard.up("g");
  await page.keyboard.press("ArrowUp");
  await page.mouse.move(box.x + 30, box.y + 40);
  await page.mouse.down();
  await page.mouse.up();
  await expect.poll(() => [keys.length, buttons.length]).toEqual([4, 2]);
  expect(keys).toEqual([["g", "KeyG", true], ["g", "KeyG", false], ["ArrowUp", "ArrowUp", true], ["ArrowUp", "ArrowUp", false]]);
  expect(buttons).toEqual([[30, 40, true], [30, 40, false]]);
  expect(await grid()).toBe(before);
  asking = false;
  await asked;
  // Once no program asks, keys belong to the page again.
  await page.getByTestId("input-note").waitFor({ state: "detached" });
  await page.keyboard.press("g");
  await expect.poll(grid).not.toBe(before);
});
