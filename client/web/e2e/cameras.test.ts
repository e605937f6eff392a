// Pictures of a robot's cameras, in the panel and in the scene. This test acts as the renderer that draws
// them.

import { expect, test } from "vitest";

import { Base } from "../src/gen/simd/v1/entity_pb";
import { Picture } from "../src/gen/simd/v1/sensor_pb";
import { Tab } from "./browser";
import { Daemon } from "./daemon";
import { fixtures } from "./fixtures";

const use = fixtures();

/** Draws pictures of one colour until it is stopped. */
function renderer(daemon: Daemon, color: readonly number[]): () => Promise<void> {
  let drawing = true;
  const ended = (async () => {
    while (drawing) {
      const { task } = await daemon.cameras.nextPicture({ renderer: "test", timeout: 0.5 });
      if (!task) continue;
      const data = new Uint8Array(3 * task.width * task.height).map((_, index) => color[index % 3] ?? 0);
      await daemon.cameras.putPicture({ id: task.id, renderer: "test", color: { data } });
    }
  })();
  return () => {
    drawing = false;
    return ended;
  };
}

test("a camera's picture is shown as it is drawn, and without a renderer what to start", async () => {
  const daemon = await use.daemon(Daemon.start([]));
  const box = { geometry: { case: "box", value: { size: { x: 0.4, y: 0.4, z: 0.4 } } }, mass: 2 } as const;
  await daemon.entities.spawnEntity({ name: "crate", base: Base.FIXED, source: { source: { case: "primitive", value: box } } });
  const camera = { picture: Picture.COLOR, width: 32, height: 24, horizontalFieldOfView: 1, near: 0.1, far: 10 };
  await daemon.sensors.createSensor({ sensor: { robot: "crate", name: "eye", kind: { case: "camera", value: camera } } });
  const tab = await Tab.open(await use.context(), daemon.url);
  const picture = tab.page.getByTestId("picture-eye");
  await expect.poll(() => picture.textContent()).toContain("simd-camera");
  const stop = renderer(daemon, [200, 30, 60]);
  const seen = () =>
    picture.locator("canvas").evaluate((canvas: HTMLCanvasElement) => {
      const pixel = canvas.width > 0 ? canvas.getContext("2d")?.getImageData(5, 5, 1, 1).data : undefined;
      return [canvas.width, canvas.height, ...(pixel ?? [])];
    });
  await expect.poll(seen).toEqual([32, 24, 200, 30, 60, 255]);
  expect(await picture.textContent()).toMatch(/at \d+\.\d{3} s/);
  // In the scene it is shown and hidden together with the points of sensors.
  await expect.poll(() => tab.page.evaluate(() => window.simd.cameraPictures())).toBe(1);
  await tab.page.evaluate(() => window.simd.camera.look([-1.2, -0.8, 0.7], [0.3, 0, 0]));
  await tab.page.waitForFunction(() => window.simd.settled());
  await tab.picture("camera");
  await tab.page.keyboard.press("u");
  await expect.poll(() => tab.page.evaluate(() => window.simd.cameraPictures())).toBe(0);
  await tab.page.keyboard.press("u");
  await expect.poll(() => tab.page.evaluate(() => window.simd.cameraPictures())).toBe(1);
  await daemon.sensors.deleteSensor({ robot: "crate", name: "eye" });
  await expect.poll(() => tab.page.evaluate(() => window.simd.cameraPictures())).toBe(0);
  await stop();
  expect(await tab.violations()).toEqual([]);
});
