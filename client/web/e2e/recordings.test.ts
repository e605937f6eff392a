// Recordings in the page: made, listed, played with the world, and read by Foxglove's packages.

import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";

import { McapIndexedReader } from "@mcap/core";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import { afterEach, beforeEach, expect, test } from "vitest";

import { SimulationState } from "../src/gen/simd/v1/simulation_pb";
import { decompress } from "../src/recording/lz4";
import { inSight, savedFile, Tab } from "./browser";
import { Daemon } from "./daemon";
import { fixtures } from "./fixtures";

const use = fixtures();
let folder: string;
let daemon: Daemon;

/** State of the daemon at a time. */
interface Seen {
  simTime: number;
  position: number;
  velocity: number;
  /** world_from_link of the arm. */
  pose: number[];
}

beforeEach(async () => {
  folder = await mkdtemp(`${tmpdir()}/simd-recordings-`);
  daemon = await use.daemon(Daemon.demo("--recordings", folder));
});

afterEach(() => rm(folder, { recursive: true, force: true }));

/** Runs this many states of 10 ms, from the next step on, and returns the daemon's state at each. */
async function run(states: number): Promise<Seen[]> {
  const seen: Seen[] = [];
  for (let state = 0; state < states; state += 1) {
    await daemon.simulation.stepSimulation({ steps: state === 0 ? 1n : 10n });
    const simTime = (await daemon.simulation.getSimulationState({})).stamp?.simTime ?? NaN;
    const { position, velocity } = await daemon.joint("bench_arm", "shoulder");
    seen.push({ simTime, position, velocity, pose: await daemon.linkPose("bench_arm", "arm") });
  }
  return seen;
}

/** Records a moving arm by the page's button; the world is paused before and after. */
async function record(tab: Tab, states: number): Promise<Seen[]> {
  await daemon.simulation.setSimulationState({ state: SimulationState.PAUSED });
  await tab.page.getByTestId("record").click();
  await tab.page.getByTestId("recording-size").waitFor();
  await daemon.aim("bench_arm", { shoulder: 1.2 });
  const seen = await run(states);
  await tab.page.getByTestId("record").click();
  await tab.page.getByTestId("recording-size").waitFor({ state: "detached" });
  return seen;
}

/** Plays the newest to its end. */
async function play(tab: Tab): Promise<void> {
  await tab.page.getByTestId("recordings").click();
  await tab.page.getByTestId("play-recording").first().click();
  await tab.page.getByTestId("playback").waitFor();
  await shown(tab, Number(await tab.page.getByTestId("time-line").getAttribute("max")));
  await expect.poll(() => tab.page.getByTestId("playback-play").getAttribute("aria-label")).toBe("Play the recording");
}

/** Opens the newest at its first state. */
async function openFirst(tab: Tab): Promise<void> {
  await play(tab);
  await tab.page.keyboard.press("Home");
  await shown(tab, 0);
}

/** Waits until a state of the recording is drawn, and returns it. */
async function shown(tab: Tab, number: number): Promise<{ simTime: number; position: number; pose: number[] }> {
  await tab.page.waitForFunction((wanted) => window.simd.recording.state()?.number === wanted, number);
  return tab.page.evaluate(() => {
    const state = window.simd.recording.state();
    const joints = state?.joints["bench_arm"];
    return {
      simTime: state?.simTime ?? NaN,
      position: joints?.position[joints.name.indexOf("shoulder")] ?? NaN,
      pose: window.simd.recording.pose("bench_arm", "arm") ?? [],
    };
  });
}

/** Returns the daemon's state at a simulated time. */
function at(seen: readonly Seen[], simTime: number): Seen {
  const found = seen.find((each) => Math.abs(each.simTime - simTime) < 1e-6);
  if (!found) throw new Error(`there was no state at ${simTime} s`);
  return found;
}

function close(pose: readonly number[], other: readonly number[]): void {
  expect(pose.length).toBe(7);
  pose.forEach((value, index) => expect(Math.abs(value - (other[index] ?? NaN))).toBeLessThan(2e-6));
}

test("a recording plays at once as a ghost, with the daemon's joints", async () => {
  const tab = await Tab.open(await use.context(), daemon.url);
  const seen = await record(tab, 30);
  // The world moves elsewhere: the ghost does not follow it.
  await daemon.aim("bench_arm", { shoulder: -0.5 });
  await daemon.simulation.stepSimulation({ steps: 300n });
  await play(tab);
  const timeLine = tab.page.getByTestId("time-line");
  const last = Number(await timeLine.getAttribute("max"));
  expect(last).toBe(29);
  for (const number of [0, 7, 18, last]) {
    await timeLine.fill(String(number));
    const state = await shown(tab, number);
    const truth = at(seen, state.simTime);
    expect(state.position).toBe(truth.position);
    close(state.pose, truth.pose);
  }
  const place = new RegExp(`^${(last / 100).toFixed(2)} s of`);
  await expect.poll(() => tab.page.getByTestId("playback-time").textContent()).toMatch(place);
  await tab.picture("playback");
  await tab.page.getByTestId("playback-alone").click();
  await tab.page.waitForFunction(() => window.simd.settled());
  await tab.picture("playback-alone");
  close((await shown(tab, last)).pose, at(seen, (await shown(tab, last)).simTime).pose);
  await tab.page.getByTestId("playback-close").click();
  await tab.page.getByTestId("playback").waitFor({ state: "detached" });
  expect(await tab.page.evaluate(() => window.simd.recording.pose("bench_arm", "arm"))).toBeUndefined();
  expect(tab.consoleMessages).toEqual([]);
});

test("the keyboard plays it, and the world stays as it is", async () => {
  const tab = await Tab.open(await use.context({ colorScheme: "dark" }), daemon.url);
  await record(tab, 20);
  await openFirst(tab);
  const before = await daemon.simulation.getSimulationState({});
  for (let number = 1; number <= 3; number += 1) {
    await tab.page.keyboard.press("ArrowRight");
    await shown(tab, number);
  }
  await tab.page.keyboard.press("ArrowLeft");
  await shown(tab, 2);
  await tab.page.keyboard.press("End");
  const last = Number(await tab.page.getByTestId("time-line").getAttribute("max"));
  await shown(tab, last);
  await tab.page.keyboard.press("Home");
  await shown(tab, 0);
  await tab.page.getByTestId("playback-speed").selectOption("10");
  await tab.page.keyboard.press("Escape");
  await tab.page.getByTestId("playback").waitFor({ state: "detached" });
  await openFirst(tab);
  await tab.page.getByTestId("time-line").focus();
  await tab.page.keyboard.press("Space");
  // It plays to its end, and stops there.
  await shown(tab, last);
  await expect.poll(() => tab.page.getByTestId("playback-play").getAttribute("aria-label")).toBe("Play the recording");
  expect((await daemon.simulation.getSimulationState({})).stamp?.step).toBe(before.stamp?.step);
});

test("its plots have what was recorded, and lead to a time", async () => {
  const tab = await Tab.open(await use.context(), daemon.url);
  await record(tab, 30);
  await play(tab);
  await tab.page.getByTestId("playback-plots").click();
  const plot = tab.page.getByTestId("playback-plot-position");
  await plot.waitFor();
  const colours = () =>
    plot.locator("canvas").evaluate((canvas: HTMLCanvasElement) => {
      const data = canvas.getContext("2d")?.getImageData(0, 0, canvas.width, canvas.height).data ?? [];
      let count = 0;
      for (let pixel = 0; pixel < data.length; pixel += 4) {
        const [red = 0, green = 0, blue = 0] = [data[pixel], data[pixel + 1], data[pixel + 2]];
        if ((data[pixel + 3] ?? 0) > 100 && Math.max(red, green, blue) - Math.min(red, green, blue) > 60) count += 1;
      }
      return count;
    });
  await expect.poll(colours).toBeGreaterThan(50);
  const over = plot.locator(".u-over");
  const box = await over.boundingBox();
  if (box === null) throw new Error("the plot has no size");
  await tab.page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
  const last = Number(await tab.page.getByTestId("time-line").getAttribute("max"));
  await tab.page.waitForFunction((middle) => Math.abs((window.simd.recording.state()?.number ?? 0) - middle) <= 1, last / 2);
  await tab.picture("playback-plots");
  expect(await tab.violations()).toEqual([]);
});

test("the list says what is in a recording, saves and deletes it", async () => {
  const tab = await Tab.open(await use.context({ acceptDownloads: true }), daemon.url);
  await record(tab, 20);
  await tab.page.getByTestId("recordings").click();
  await tab.page.getByTestId("recording-contents").click();
  await expect.poll(() => tab.page.getByTestId("recording-list").textContent()).toContain("/bench_arm/joint_states");
  expect(await tab.violations()).toEqual([]);
  await tab.picture("recordings");
  const [download] = await Promise.all([tab.page.waitForEvent("download"), tab.page.getByTestId("save-recording").click()]);
  const saved = await readFile(await savedFile(download));
  expect(Buffer.compare(saved, await readFile(join(folder, download.suggestedFilename())))).toBe(0);
  await tab.page.getByTestId("delete-recording").click();
  await tab.page.getByTestId("delete-surely").click();
  await tab.page.getByTestId("recording-list").waitFor({ state: "detached" });
  expect((await daemon.recordings.listRecordings({})).recordings).toEqual([]);
});

test("a file of this machine is played; another file is refused with a sentence", async () => {
  const tab = await Tab.open(await use.context(), daemon.url);
  const seen = await record(tab, 10);
  const [recording] = (await daemon.recordings.listRecordings({})).recordings;
  const bytes = await readFile(join(folder, recording?.files[0]?.name ?? ""));
  const open = async (name: string, content: Uint8Array): Promise<void> => {
    await writeFile(join(folder, name), content);
    if (!(await tab.page.getByTestId("recordings-sheet").isVisible())) await tab.page.getByTestId("recordings").click();
    await tab.page.getByTestId("recording-file").setInputFiles(join(folder, name));
  };
  const says = (text: RegExp) => expect.poll(() => tab.page.getByTestId("toast").allTextContents()).toContainEqual(expect.stringMatching(text));
  await open("text.mcap", new TextEncoder().encode("no recording"));
  await says(/text\.mcap cannot be shown: it is not a file of MCAP\./);
  await open("begun.mcap", bytes.subarray(0, 200));
  await says(/begun\.mcap cannot be shown: it has no states/);
  await open("cut.mcap", bytes.subarray(0, bytes.length - 50));
  await tab.page.getByTestId("playback").waitFor();
  expect(await inSight(tab.page, "playback-note")).toContain("not completed");
  const state = await shown(tab, 0);
  expect(state.position).toBe(at(seen, state.simTime).position);
  // The recorded robot is no longer in the world: it is drawn from its description.
  await daemon.entities.deleteEntity({ robot: "bench_arm" });
  await tab.page.waitForFunction(() => window.simd.frame()?.joints.size === 0);
  close((await shown(tab, 0)).pose, at(seen, state.simTime).pose);
});

test("a key starts a recording also on a daemon that names no folder for them", async () => {
  const other = await use.daemon(Daemon.demo());
  const tab = await Tab.open(await use.context(), other.url);
  await tab.page.keyboard.press("r");
  await tab.page.getByTestId("recording-size").waitFor();
  expect((await other.recordings.listRecordings({})).recordings).toHaveLength(1);
});

test("Foxglove's packages read the states that the daemon had", async () => {
  const tab = await Tab.open(await use.context(), daemon.url);
  const seen = await record(tab, 20);
  const [recording] = (await daemon.recordings.listRecordings({})).recordings;
  const bytes = await readFile(join(folder, recording?.files[0]?.name ?? ""));
  const reader = await McapIndexedReader.Initialize({
    readable: { size: async () => BigInt(bytes.length), read: async (offset, length) => bytes.subarray(Number(offset), Number(offset + length)) },
    decompressHandlers: { lz4: (data, size) => decompress(data, Number(size)) },
  });
  const decoded = async function* <T>(topic: string): AsyncGenerator<T> {
    const channel = [...reader.channelsById.values()].find((each) => each.topic === topic);
    const schema = reader.schemasById.get(channel?.schemaId ?? 0);
    const messages = new MessageReader(parse(new TextDecoder().decode(schema?.data), { ros2: true }));
    for await (const { data } of reader.readMessages({ topics: [topic] })) yield messages.readMessage<T>(data);
  };
  interface Stamp {
    stamp: { sec: number; nanosec: number };
  }
  const time = ({ stamp }: Stamp): number => stamp.sec + stamp.nanosec * 1e-9;
  let count = 0;
  for await (const { header, name, position, velocity } of decoded<{ header: Stamp; name: string[]; position: Float64Array; velocity: Float64Array }>("/bench_arm/joint_states")) {
    const truth = at(seen, time(header));
    const index = name.indexOf("shoulder");
    expect([position[index], velocity[index]]).toEqual([truth.position, truth.velocity]);
    count += 1;
  }
  expect(count).toBe(20);
  let frames = 0;
  interface Frame {
    header: Stamp & { frame_id: string };
    child_frame_id: string;
    transform: { translation: { x: number; y: number; z: number }; rotation: { x: number; y: number; z: number; w: number } };
  }
  for await (const { transforms } of decoded<{ transforms: Frame[] }>("/tf")) {
    const root = transforms.find(({ header }) => header.frame_id === "world");
    const arm = transforms.find(({ child_frame_id }) => child_frame_id === "bench_arm/arm");
    if (!root || !arm) throw new Error("a transform is missing");
    // The demo's base is at the origin, so the arm's pose in its base is its pose in the world.
    expect(arm.header.frame_id).toBe(root.child_frame_id);
    expect(root.transform.translation).toEqual({ x: 0, y: 0, z: 0 });
    const { translation, rotation } = arm.transform;
    close([translation.x, translation.y, translation.z, rotation.x, rotation.y, rotation.z, rotation.w], at(seen, time(arm.header)).pose);
    frames += 1;
  }
  expect(frames).toBe(count);
});
