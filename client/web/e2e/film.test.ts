// Videos of the picture and of a paused world by steps: the contents of their files, and that they are saved in any case.

import { readFile } from "node:fs/promises";

import type { Download } from "playwright-core";
import { expect, test } from "vitest";

import { Base } from "../src/gen/simd/v1/entity_pb";
import { SimulationState } from "../src/gen/simd/v1/simulation_pb";
import { savedFile, Tab } from "./browser";
import { Daemon } from "./daemon";
import { fixtures } from "./fixtures";

const use = fixtures();
/** The processor encodes videos. */
const SMALL = { acceptDownloads: true, viewport: { width: 800, height: 500 } };

/** A paused world with a red box of 0.4 m. */
async function paused(): Promise<Daemon> {
  const daemon = await use.daemon(Daemon.start(["--paused", "--gravity", "0,0,0"]));
  const primitive = { geometry: { case: "box", value: { size: { x: 0.4, y: 0.4, z: 0.4 } } }, mass: 1, color: { red: 1, green: 0, blue: 0, alpha: 1 } } as const;
  await daemon.entities.spawnEntity({ name: "crate", base: Base.FREE, pose: { position: { x: 0, y: 0, z: 0.5 } }, source: { source: { case: "primitive", value: primitive } } });
  return daemon;
}

async function open(tab: Tab, item: string): Promise<void> {
  await tab.page.getByTestId("build").click();
  await tab.page.getByTestId(item).click();
}

/** Returns the bytes of a video, which begin like WebM: with the header of EBML. */
async function saved(download: Download): Promise<Buffer> {
  const bytes = await readFile(await savedFile(download));
  expect([...bytes.subarray(0, 4)]).toEqual([0x1a, 0x45, 0xdf, 0xa3]);
  expect(bytes.length).toBeGreaterThan(1000);
  return bytes;
}

test("a video of the picture is a WebM file", async () => {
  const daemon = await paused();
  const tab = await Tab.open(await use.context(SMALL), daemon.url);
  await open(tab, "build-film");
  for (let index = 0; index < 12; index += 1) {
    await tab.page.keyboard.press("ArrowLeft");
    await tab.page.waitForFunction(() => window.simd.settled());
  }
  await tab.page.getByTestId("build").click();
  const [download] = await Promise.all([tab.page.waitForEvent("download"), tab.page.getByTestId("build-film").click()]);
  await saved(download);
});

test("a video of steps lasts as long as what is simulated in it, however slow the page is", async () => {
  const daemon = await paused();
  await daemon.entities.setEntityState({ robot: "crate", twist: { linear: { x: 0.3, y: 0, z: 0 } } });
  const tab = await Tab.open(await use.context(SMALL), daemon.url);
  const time = async (): Promise<number> => (await daemon.simulation.getSimulationState({})).stamp?.simTime ?? NaN;
  const begun = await time();
  await open(tab, "build-film-steps");
  await expect.poll(time, { interval: 20 }).toBeGreaterThan(begun + 0.5);
  await tab.page.getByTestId("build").click();
  const [download] = await Promise.all([tab.page.waitForEvent("download"), tab.page.getByTestId("build-film").click()]);
  expect((await daemon.simulation.getSimulationState({})).state).toBe(SimulationState.PAUSED);
  const simulated = (await time()) - begun;
  const bytes = await saved(download);
  // Plays in a separate page: the daemon's policy allows no video, because its page needs none.
  const player = await tab.page.context().newPage();
  const film = await player.evaluate(async (text) => {
    const video = document.createElement("video");
    const file = new Blob([Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0))], { type: "video/webm" });
    video.src = URL.createObjectURL(file);
    const happened = (name: string) => new Promise((done, failed) => { video.addEventListener(name, done, { once: true }); video.addEventListener("error", failed, { once: true }); });
    await happened("loadeddata");
    const drawing = new OffscreenCanvas(video.videoWidth, video.videoHeight).getContext("2d");
    if (drawing === null) throw new Error("no canvas");
    // The mean column of the red pixels.
    const redAt = async (time: number): Promise<number> => {
      const seeked = happened("seeked");
      video.currentTime = time;
      await seeked;
      // The canvas is black until the browser shows the picture, which may come after the browser reports it.
      const picture = (): ImageData => {
        drawing.drawImage(video, 0, 0);
        return drawing.getImageData(0, 0, video.videoWidth, video.videoHeight);
      };
      const isBlack = ({ data }: ImageData): boolean => data.every((value, index) => index % 4 === 3 || value === 0);
      let seen = picture();
      for (let tries = 0; tries < 1000 && isBlack(seen); tries += 1) {
        await new Promise((done) => setTimeout(done, 50));
        seen = picture();
      }
      const { data, width } = seen;
      let [sum, count] = [0, 0];
      for (let index = 0; index < data.length; index += 4) {
        const [red = 0, green = 0, blue = 0] = data.subarray(index, index + 3);
        if (red > 80 && red > 2 * green && red > 2 * blue) [sum, count] = [sum + ((index / 4) % width), count + 1];
      }
      return sum / count;
    };
    return { duration: video.duration, width: video.videoWidth, moved: Math.abs((await redAt(video.duration - 0.01)) - (await redAt(0.1))) };
  }, bytes.toString("base64"));
  expect(film.width).toBeGreaterThan(100);
  console.log(`a video of steps: ${film.duration.toFixed(2)} s for ${simulated.toFixed(2)} simulated s, ${film.moved.toFixed(0)} pixels`);
  expect(Math.abs(film.duration - simulated)).toBeLessThan(0.005);
  expect(film.moved).toBeGreaterThan(10);
});

test("a video of steps is ended and saved though a step is never answered", async () => {
  const daemon = await paused();
  const tab = await Tab.open(await use.context(SMALL), daemon.url);
  let steps = 0;
  await tab.page.route("**/simd.v1.SimulationService/StepSimulation", async (route) => {
    steps += 1;
    if (steps < 10) await route.continue();
  });
  await open(tab, "build-film-steps");
  await expect.poll(() => steps).toBe(10);
  await tab.page.getByTestId("film-note").waitFor();
  expect(await tab.violations()).toEqual([]);
  await tab.picture("film-note");
  const [download] = await Promise.all([tab.page.waitForEvent("download"), tab.page.getByTestId("film-end").click()]);
  await saved(download);
  await tab.page.getByTestId("film-note").waitFor({ state: "detached" });
});

test("a video of steps is saved when the daemon is lost", async () => {
  const daemon = await paused();
  const tab = await Tab.open(await use.context(SMALL), daemon.url);
  let steps = 0;
  await tab.page.route("**/simd.v1.SimulationService/StepSimulation", async (route) => {
    steps += 1;
    if (steps < 10) return route.continue();
    // The answer of this call never comes, nor does any other.
    await daemon.kill();
  });
  const ended = tab.page.waitForEvent("download");
  await open(tab, "build-film-steps");
  await saved(await ended);
  await tab.page.getByTestId("film-note").waitFor({ state: "detached" });
});

test("a video of steps is saved up to a failure of the encoder", async () => {
  const daemon = await paused();
  const context = await use.context(SMALL);
  await context.addInitScript(() => {
    if (!("VideoEncoder" in globalThis)) return;
    const { encode } = VideoEncoder.prototype;
    let pictures = 0;
    VideoEncoder.prototype.encode = function (...what): void {
      pictures += 1;
      if (pictures > 25) throw new Error("the encoder has failed");
      encode.apply(this, what);
    };
  });
  const tab = await Tab.open(context, daemon.url);
  const ended = tab.page.waitForEvent("download");
  await open(tab, "build-film-steps");
  await saved(await ended);
  await expect.poll(async () => (await tab.page.getByTestId("toast").allTextContents()).join()).toContain("the encoder has failed");
  await tab.page.getByTestId("film-note").waitFor({ state: "detached" });
});
