// The main path in Debian's Firefox: the page opens, a robot is loaded, its slider moves it, its joint is
// plotted.

import { afterAll, beforeAll, expect, test } from "vitest";

import { Daemon } from "./daemon";
import { Firefox } from "./firefox";
import { fixtures } from "./fixtures";
import { moved } from "./mesh";

const use = fixtures();
let firefox: Firefox;
beforeAll(async () => {
  firefox = await Firefox.start(1280, 720);
});
afterAll(async () => {
  await firefox.close();
});

/** Metres from a link's frame to the middle of the link, along z: both of these are orange. */
const MIDDLES = { upper_arm: 0.17, forearm: 0.14 };

/** Whether the picture has the arm's colour at the middles of its links as the daemon reports them. */
async function isWhereItIs(daemon: Daemon, robot: string, name: string): Promise<boolean> {
  const sequence = (await daemon.joints.getJointStates({})).states?.stamp?.sequence ?? 0n;
  await firefox.until((least) => window.simd.drawn() >= BigInt(least), sequence.toString());
  const middles = await Promise.all(Object.entries(MIDDLES).map(async ([link, z]) => moved(await daemon.linkPose(robot, link), [0, 0, z])));
  const places = await firefox.evaluate((points) => points.map((point) => window.simd.project(point as [number, number, number])), middles);
  const png = (await firefox.picture(name)).toString("base64");
  const colours = await firefox.evaluate(
    async (text, at) => {
      const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
      const image = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
      const drawing = new OffscreenCanvas(image.width, image.height).getContext("2d");
      drawing?.drawImage(image, 0, 0);
      return at.map(({ x, y }) => [...(drawing?.getImageData(Math.round(x), Math.round(y), 1, 1).data ?? [])]);
    },
    png,
    places,
  );
  return colours.every(([red = 0, green = 0, blue = 0]) => red > 80 && red > 1.2 * green && green > 1.5 * blue);
}

test("Firefox shows a robot, moves it by its slider and plots it", async () => {
  const daemon = await use.daemon(Daemon.start(["--gravity", "0,0,0"]));
  await firefox.open(daemon.url);
  await firefox.click("add-demo-arm");
  await firefox.until(() => document.querySelectorAll("[data-testid=slider]").length >= 5);
  await firefox.until(() => window.simd.settled());
  const [robot = ""] = (await daemon.entities.listEntities({})).entities.map(({ name }) => name);
  await expect.poll(() => isWhereItIs(daemon, robot, "firefox-before")).toBe(true);

  const slider = await firefox.evaluate(() => {
    const row = document.querySelector('[data-testid$="/shoulder"] [data-testid=slider]');
    const { x = 0, y = 0, width = 0, height = 0 } = row?.getBoundingClientRect() ?? {};
    return { x: x + width / 2, y: y + height / 2, width };
  });
  await firefox.drag(slider, { x: slider.x + slider.width / 4, y: slider.y });
  const shoulder = () => daemon.joint(robot, "shoulder");
  await expect.poll(async () => (await shoulder()).target).toBeGreaterThan(0.5);
  await expect.poll(async () => Math.abs((await shoulder()).target - (await shoulder()).position)).toBeLessThan(0.02);
  await expect.poll(async () => Math.abs((await shoulder()).velocity)).toBeLessThan(0.01);

  await firefox.press("p");
  await firefox.until(() => document.querySelector("[data-testid=plot] canvas") !== null);
  await firefox.evaluate(() => document.querySelector<HTMLElement>('[data-testid$="/shoulder"] [data-testid=plot-joint][aria-pressed=false]')?.click());
  // The line is coloured; the grid and the letters are grey.
  await firefox.until(() => {
    const canvas = document.querySelector<HTMLCanvasElement>("[data-testid=plot] canvas");
    const data = canvas?.getContext("2d")?.getImageData(0, 0, canvas.width, canvas.height).data ?? [];
    let coloured = 0;
    for (let at = 0; at < data.length; at += 4) {
      const parts = [data[at] ?? 0, data[at + 1] ?? 0, data[at + 2] ?? 0];
      if ((data[at + 3] ?? 0) > 100 && Math.max(...parts) - Math.min(...parts) > 60) coloured += 1;
    }
    return coloured > 50;
  });
  await expect.poll(() => isWhereItIs(daemon, robot, "firefox")).toBe(true);
});
