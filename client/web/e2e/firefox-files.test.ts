// The user's files in Debian's Firefox. Then a view that is kept while a robot moves, a recording, a blocked joint, and a restart of the daemon.

import { mkdir, mkdtemp, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { resolve } from "node:path";

import { afterAll, beforeAll, expect, test } from "vitest";

import { Base } from "../src/gen/simd/v1/entity_pb";
import { zipOf } from "../src/load/zip-fixture";
import { seenAtMiddle } from "./browser";
import { Daemon } from "./daemon";
import { Firefox } from "./firefox";
import { fixtures } from "./fixtures";

const use = fixtures();
let firefox: Firefox;
let folder: string;
beforeAll(async () => {
  folder = await mkdtemp(`${tmpdir()}/simd-firefox-files-`);
  firefox = await Firefox.start(1280, 720);
});
afterAll(async () => {
  await firefox.close();
  await rm(folder, { recursive: true, force: true });
});

/** Opens the page of a daemon, and waits until its world is drawn. */
async function open({ url }: Daemon): Promise<void> {
  await firefox.open(url);
  await firefox.until(() => window.simd?.frame() != null && window.simd.settled());
}

const names = async (daemon: Daemon): Promise<string[]> => (await daemon.entities.listEntities({})).entities.map(({ name }) => name);

test("Firefox opens a zip, offers its descriptions, and puts the chosen ones side by side on the ground", async () => {
  const daemon = await use.daemon(Daemon.start(["--gravity", "0,0,0"]));
  const shape = '<geometry><box size="0.2 1 0.2"/></geometry>';
  const parts = Array.from({ length: 6 }, (_, index) => ({
    name: `robots/robot_${index}.urdf`,
    bytes: `<robot name="robot_${index}"><link name="base"><visual>${shape}</visual><collision>${shape}</collision></link></robot>`,
  }));
  const zip = resolve(folder, "robots.zip");
  await writeFile(zip, zipOf(parts));
  await open(daemon);
  await firefox.choose("file-input", zip);
  await firefox.until(() => document.querySelectorAll("[data-testid=load-choice]").length === 6);
  expect(await firefox.evaluate(() => document.querySelector("[data-testid=load-choice]")?.textContent)).toBe("robot_0.urdfURDF1 link");
  await firefox.evaluate(() => document.querySelectorAll<HTMLElement>("[data-testid=load-choice] input")[3]?.click());
  await firefox.until(() => document.querySelector("[data-testid=load-now]")?.textContent?.includes("Load 2 robots") === true);
  await firefox.picture("firefox-choices");
  await firefox.click("load-now");
  await expect.poll(async () => (await names(daemon)).sort()).toEqual(["robot_0", "robot_3"]);
  const places = [];
  for (const robot of ["robot_0", "robot_3"]) {
    const { y, z } = (await daemon.entities.getEntityState({ robot })).pose?.position ?? {};
    places.push([y, z].map((value) => Number(value?.toFixed(9))));
  }
  expect(places).toEqual([
    [0, 0.1],
    [1.2, 0.1],
  ]);
  await firefox.until(() => window.simd.frame()?.joints.size === 2 && window.simd.settled());
  await firefox.picture("firefox-side-by-side");
});

test("Firefox keeps the view over a reload while the robot moves", async () => {
  const daemon = await use.daemon(Daemon.demo());
  await open(daemon);
  await daemon.joints.setJointTargets({ robots: [{ robot: "bench_arm", joints: [{ joint: "shoulder", target: { case: "velocity", value: { velocity: 1 } } }] }] });
  const before = await firefox.evaluate(() => [...window.simd.camera.position(), ...window.simd.camera.target()]);
  const corner = await firefox.evaluate(() => {
    const { left = 0, top = 0 } = document.querySelector("[data-testid=viewport]")?.getBoundingClientRect() ?? {};
    return { x: left + 30, y: top + 30 };
  });
  await firefox.drag(corner, { x: corner.x + 160, y: corner.y + 60 });
  const distance = (from: number[], to: number[]): number => Math.hypot(...from.map((value, index) => value - (to[index] ?? NaN)));
  const camera = () => firefox.evaluate(() => [...window.simd.camera.position(), ...window.simd.camera.target()]);
  // It has moved, and is almost at rest: three pictures show the same.
  let [last, pictures] = [before, 0];
  const rests = async (): Promise<boolean> => {
    const count = await firefox.evaluate(() => window.simd.stats.pictures());
    if (count < pictures + 3) return false;
    const from = last;
    [last, pictures] = [await camera(), count];
    return distance(last, before) > 0.1 && distance(last, from) < 1e-3;
  };
  await expect.poll(rests).toBe(true);
  await open(daemon);
  expect(distance(await camera(), last)).toBeLessThan(0.02);
  await firefox.picture("firefox-view-kept");
});

test("Firefox plays a recording at once, and says which link blocks a joint", async () => {
  const recordings = resolve(folder, "recordings");
  await mkdir(recordings);
  const daemon = await use.daemon(Daemon.start(["--gravity", "0,0,0", "--recordings", recordings]));
  await open(daemon);
  await firefox.click("add-demo-arm");
  await firefox.until(() => document.querySelectorAll("[data-testid=slider]").length === 5);
  const { recording } = await daemon.recordings.startRecording({});
  const box = { geometry: { case: "box", value: { size: { x: 0.2, y: 1, z: 0.6 } } }, mass: 1 } as const;
  await daemon.entities.spawnEntity({ name: "wall", base: Base.FIXED, pose: { position: { x: 0.4, y: 0, z: 0.5 } }, source: { source: { case: "primitive", value: box } } });
  await daemon.aim("demo_arm", { shoulder: 1.2 });
  await firefox.until(() => [...document.querySelectorAll("[data-testid=badge]")].some(({ textContent }) => textContent?.startsWith("blocked by wall") === true));
  await firefox.until(() => document.querySelectorAll("[role=tab]").length === 2 && window.simd.settled());
  await firefox.picture("firefox-blocked");
  await daemon.recordings.stopRecording({ name: recording?.name ?? "" });
  await firefox.click("recordings");
  await firefox.click("play-recording");
  await firefox.until(() => {
    const state = window.simd.recording.state();
    return state !== null && state.number === Number(document.querySelector("[data-testid=time-line]")?.getAttribute("max"));
  });
  await firefox.picture("firefox-recording");
  await firefox.click("playback-close");
  await firefox.until(() => document.querySelector("[data-testid=playback]") === null);
});

test("Firefox offers to load the robots again after a restart of the daemon", async () => {
  const first = await use.daemon(Daemon.start(["--gravity", "0,0,0"]));
  await open(first);
  await firefox.click("add-demo-arm");
  await firefox.until(() => document.querySelectorAll("[data-testid=slider]").length === 5);
  // States may show the arm before the answer of the call, which the page remembers.
  await firefox.click("build");
  await firefox.until(() => document.querySelector("[data-testid=build-undo]:not([disabled])") !== null);
  await firefox.click("build");
  await first.kill();
  await firefox.until(() => document.querySelector("[data-testid=banner]") !== null);
  const second = await use.daemon(Daemon.again(["--gravity", "0,0,0"], first));
  await firefox.until(() => document.querySelector("[data-testid=restart-note]") !== null);
  expect(await firefox.evaluate(seenAtMiddle, "[data-testid=restart-note]")).toEqual({ seen: 1, all: 1 });
  await firefox.picture("firefox-restarted");
  await firefox.click("load-again");
  await expect.poll(() => names(second)).toEqual(["demo_arm"]);
  await firefox.until(() => document.querySelectorAll("[data-testid=slider]").length === 5);
});
