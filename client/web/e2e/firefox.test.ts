// The main path in Debian's Firefox: the page opens, a robot is loaded, its slider moves it, its joint is plotted. Then what a newcomer
// meets: little room, names of any script, claims, the help, links, frames, and errors.

import { once } from "node:events";
import { mkdtemp, rm, writeFile } from "node:fs/promises";
import { createServer } from "node:http";
import type { AddressInfo } from "node:net";
import { tmpdir } from "node:os";
import { resolve } from "node:path";

import { afterAll, beforeAll, expect, test } from "vitest";

import { Base } from "../src/gen/simd/v1/entity_pb";
import { colouredPixels, rowOfBar, seenAtMiddle } from "./browser";
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
  await expect.poll(() => firefox.evaluate(colouredPixels)).toBeGreaterThan(50);
  await expect.poll(() => isWhereItIs(daemon, robot, "firefox")).toBe(true);
});

/** Names of joints whose ends differ, in several scripts. */
const NAMES = ["плечо_правой_руки_робота_для_сборки_левое", "机器人装配单元左侧夹爪手指远端关节右侧第二节", "مفصل_كتف_الذراع_اليمنى_للروبوت", "🤖🦾 joint"];

test("Firefox shows a newcomer joints of any script on a phone that lies, claims, helps, copies a link, is framed, and reports a lost daemon", async () => {
  let address = "";
  const site = createServer((_, answer) => answer.setHeader("content-type", "text/html").end(`<iframe src="${address}" style="width: 700px; height: 340px"></iframe>`));
  site.listen(0, "127.0.0.1");
  await once(site, "listening");
  const { port } = site.address() as AddressInfo;
  const folder = await mkdtemp(`${tmpdir()}/simd-firefox-frame-`);
  try {
    await writeFile(resolve(folder, "simd.toml"), `frame_ancestors = ["http://127.0.0.1:${port}"]\n`);
    const daemon = await use.daemon(Daemon.start(["--config", resolve(folder, "simd.toml"), "--paused", "--gravity", "0,0,0"]));
    address = daemon.url;
    const joints = NAMES.map((name, index) => `<link name="l${index}"/><joint name="${name}" type="continuous"><parent link="base"/><child link="l${index}"/><axis xyz="0 0 1"/></joint>`);
    const urdf = new TextEncoder().encode(`<robot name="hand"><link name="base"/>${joints.join("")}</robot>`);
    await daemon.entities.spawnEntity({ name: "hand", base: Base.FIXED, source: { source: { case: "urdf", value: urdf } } });
    await firefox.resize(740, 360);
    await firefox.open(daemon.url);
    await firefox.until((count) => document.querySelectorAll("[data-testid=slider]").length === count && window.simd.settled(), NAMES.length);
    expect((await firefox.evaluate(seenAtMiddle, "[data-testid=slider]")).seen).toBeGreaterThanOrEqual(2);
    const { spread, over } = await firefox.evaluate(rowOfBar);
    expect(spread).toBeLessThan(0.3);
    expect(over).toBeLessThanOrEqual(0);
    // Names are whole in the document, and their ends are visible.
    expect(await firefox.evaluate(() => [...document.querySelectorAll(".joint .joint-name")].map((name) => name.textContent))).toEqual(NAMES);
    await firefox.picture("firefox-phone-that-lies");

    // Claimed and released by a button.
    const claimed = async () => (await daemon.entities.getEntityInfo({ robot: "hand" })).entity?.claimedBy ?? "";
    await firefox.click("claim-robot");
    await expect.poll(claimed).toMatch(/^viewer-/);
    await firefox.until(() => document.querySelector("[data-testid=claim-robot]")?.getAttribute("aria-pressed") === "true");
    await firefox.picture("firefox-claimed");
    await firefox.click("claim-robot");
    await expect.poll(claimed).toBe("");

    // Its row shows the reason why a joint does not move.
    await daemon.aim("hand", { [NAMES[0] ?? ""]: 0.5 });
    await firefox.until(() => document.querySelector("[data-testid=badge]")?.textContent === "paused");

    await firefox.press("?");
    await firefox.click("help-begin");
    await firefox.until((url) => [...document.querySelectorAll("[data-testid=guide-command]")].some(({ textContent }) => textContent?.includes(url)), new URL(daemon.url).host);
    await firefox.until(() => document.querySelector("[data-testid=guide-zenoh]")?.getAttribute("data-way") === "off");
    await firefox.picture("firefox-help");
    await firefox.press("\uE00C");
    await firefox.until(() => document.querySelector("[data-testid=help-sheet]") === null);

    // A link that is copied shows the same camera.
    await firefox.evaluate(() => {
      const page = window as unknown as { copied: string };
      navigator.clipboard.writeText = (text) => Promise.resolve(void (page.copied = text));
      window.simd.camera.look([3, 1, 2], [0, 0.5, 0.25]);
    });
    await firefox.until(() => window.simd.settled());
    await firefox.click("view-menu");
    await firefox.click("copy-link");
    await firefox.until(() => (window as unknown as { copied?: string }).copied !== undefined);
    const link = await firefox.evaluate(() => (window as unknown as { copied: string }).copied);
    await firefox.open("about:blank");
    await firefox.open(link);
    await firefox.until(() => window.simd?.frame() != null && window.simd.settled());
    const camera = await firefox.evaluate(() => [...window.simd.camera.position(), ...window.simd.camera.target()]);
    camera.forEach((value, index) => expect(value).toBeCloseTo([3, 1, 2, 0, 0.5, 0.25][index] ?? NaN, 3));

    await firefox.picture("firefox-link");

    // Framed by the site that the operator named: the page in the frame reports its camera.
    const pages = async (): Promise<number> => (await daemon.view.getCameras({})).cameras.length;
    await firefox.open(`http://127.0.0.1:${port}/`);
    await expect.poll(pages).toBe(1);
    await firefox.picture("firefox-framed");

    // A lost daemon is reported where users see it.
    await firefox.open(daemon.url);
    await firefox.until(() => window.simd?.frame() != null);
    await daemon.kill();
    await firefox.until(() => document.querySelector("[data-testid=banner]") !== null);
    expect(await firefox.evaluate(seenAtMiddle, "[data-testid=banner]")).toEqual({ seen: 1, all: 1 });
    await firefox.picture("firefox-lost");
  } finally {
    site.close();
    await rm(folder, { recursive: true });
  }
});
