// Recordings that are complete, cut short, damaged, or third-party.
import { afterEach, expect, test, vi } from "vitest";
import { positionOf, recording } from "./fixture";
import { McapFile } from "./mcap-file";
import { fileSource, type Source } from "./source";
import { Timeline } from "./timeline";

/** Milliseconds: some of these read a file thousands of times. */
const LONG = 120_000;

function source(bytes: Uint8Array<ArrayBuffer>, name = "run.mcap"): Source {
  return fileSource({
    name,
    size: bytes.length,
    slice: (from: number, to: number) => ({ arrayBuffer: async () => bytes.slice(from, to).buffer }),
  } as unknown as File);
}

function open(...files: Uint8Array<ArrayBuffer>[]): Promise<Timeline> {
  return Timeline.open(files.map((bytes, index) => source(bytes, `run.${index}.mcap`)));
}

afterEach(() => vi.useRealTimers());

/** All states have the written values. */
async function check(timeline: Timeline, count: number): Promise<void> {
  expect(timeline.count).toBe(count);
  for (let number = 0; number < count; number += 1) {
    const { simTime, poses, joints } = await timeline.state(number);
    expect(simTime).toBeCloseTo(number / 100, 9);
    const arm = poses.get("arm-1");
    expect([...(arm?.keys() ?? [])].sort()).toEqual(["base", "link", "tool"]);
    expect(arm?.get("tool")?.[0]).toBeCloseTo(1 + positionOf(number) + 3, 12);
    expect(joints.get("arm_1")).toMatchObject({ name: ["elbow"], position: [positionOf(number)], velocity: [1], effort: [2] });
  }
}

test.each(["lz4", ""] as const)("each state is what was written (%s)", async (compression) => {
  const timeline = await open(await recording({ compression }));
  await check(timeline, 100);
  expect(timeline.period).toBeCloseTo(0.01, 9);
  expect(timeline.descriptions.get("arm_1")).toContain("<robot");
  expect([...timeline.problems]).toEqual([]);
  const all = await Promise.all(timeline.spans().map(({ first }) => timeline.jointsOf(first)));
  expect(all.flat().length).toBe(100);
  expect(timeline.spans().length).toBeGreaterThan(8);
}, LONG);

test("chunks that end within a state, and one for all, are the same", async () => {
  // In small chunks, a state of three messages spans two chunks or more. More than two exceed the written ones.
  for (const chunkSize of [900, 1000, 1100, 1300]) await check(await open(await recording({ states: 20, chunkSize })), 20);
  await check(await open(await recording({ states: 20, chunkSize: 1 << 20 })), 20);
}, LONG);

test("an incomplete file is read up to its end, wherever it is", async () => {
  const whole = await recording({ end: false });
  const { chunks } = await McapFile.open(source(whole));
  expect(chunks.length).toBeGreaterThan(8);
  for (const { offset, length } of chunks) {
    for (const cut of [offset - 1, offset, offset + 1, offset + 9, offset + length - 1, offset + length, offset + length + 20]) {
      // The marks of a recording come before the first chunk.
      if (cut < (chunks[0]?.offset ?? 0)) continue;
      const opened = McapFile.open(source(whole.slice(0, cut)));
      const before = chunks.filter((chunk) => chunk.offset + chunk.length + 20 < cut).length;
      const found = (await opened).chunks.length;
      expect(found).toBeGreaterThanOrEqual(before);
      expect(found).toBeLessThanOrEqual(before + 1);
    }
  }
  const timeline = await open(whole.slice(0, chunks[5]?.offset));
  expect([...timeline.problems][0]).toContain("not completed");
  await check(timeline, timeline.count);
  expect(timeline.count).toBeGreaterThan(30);
}, LONG);

test("a flipped byte costs at most its chunk, and is reported", async () => {
  const whole = await recording({ states: 60 });
  const { chunks } = await McapFile.open(source(whole));
  const chunk = chunks[3];
  if (!chunk) throw new Error("there are too few chunks");
  for (let at = chunk.offset + 60; at < chunk.offset + chunk.length; at += 37) {
    const damaged = whole.slice();
    damaged[at] = (damaged[at] ?? 0) ^ 0x55;
    const timeline = await open(damaged);
    let lost = 0;
    for (let number = 0; number < timeline.count; number += 1) {
      const state = await timeline.state(number);
      if (state.poses.size === 0) lost += 1;
      else expect(state.simTime).toBeCloseTo(number / 100, 9);
    }
    expect(lost).toBe(chunk.messages.get("/tf"));
    expect([...timeline.problems].join()).toMatch(/^Run\.0\.mcap is damaged at byte \d+: .*\.$/i);
  }
}, LONG);

test("flipped bytes anywhere give a sentence, or a recording", async () => {
  const whole = await recording({ states: 10, chunkSize: 1500 });
  for (let at = 0; at < whole.length; at += 11) {
    const damaged = whole.slice();
    damaged[at] = (damaged[at] ?? 0) ^ 0xff;
    try {
      const timeline = await open(damaged);
      for (let number = 0; number < Math.min(20, timeline.count); number += 1) await timeline.state(number);
    } catch (error) {
      expect(error).toBeInstanceOf(Error);
      expect(String(error)).not.toContain("undefined");
    }
  }
}, LONG);

test("other files are refused with a sentence", async () => {
  const text = new TextEncoder().encode("This is not a recording, but a text about one.");
  await expect(open(text as Uint8Array<ArrayBuffer>)).rejects.toThrow("it is not a file of MCAP");
  await expect(open(new Uint8Array(0))).rejects.toThrow("it is not a file of MCAP");
  await expect(open(await recording({ format: "" }))).rejects.toThrow("not a recording of simd");
  await expect(open(await recording({ format: "7" }))).rejects.toThrow("made by a newer release");
  expect((await open(await recording({ format: "6" }))).count).toBe(100);
  await expect(open(await recording({ states: 0 }))).rejects.toThrow("no states");
  // The first bytes of a file and nothing more.
  await expect(open((await recording({ states: 5 })).slice(0, 8))).rejects.toThrow("not a recording of simd");
});

test("several files are one recording", async () => {
  const timeline = await open(await recording({ states: 30 }), await recording({ states: 12, end: false, chunkSize: 1500 }));
  const last = timeline.count - 1;
  expect(last).toBeGreaterThanOrEqual(30);
  expect((await timeline.state(29)).simTime).toBeCloseTo(0.29, 9);
  expect((await timeline.state(30)).simTime).toBeCloseTo(0, 9);
});

test("chunks are kept within bounds, and read again", async () => {
  const bytes = await recording({ states: 200 });
  let reads = 0;
  const counted: Source = { ...source(bytes), read: (offset, length) => ((reads += 1), source(bytes).read(offset, length)) };
  const timeline = await Timeline.open([counted]);
  const before = reads;
  for (let round = 0; round < 3; round += 1) for (let number = 0; number < 20; number += 1) await timeline.state(number);
  expect(reads).toBe(before);
});

test("a chunk that a lost daemon does not send is requested again a second later, and is not a gap", async () => {
  const bytes = await recording({ states: 200 });
  let isLost = false;
  let reads = 0;
  const whole = source(bytes);
  const read: Source["read"] = (offset, length) => {
    reads += 1;
    return isLost ? Promise.reject(new TypeError("Failed to fetch")) : whole.read(offset, length);
  };
  const timeline = await Timeline.open([{ ...whole, read }]);
  vi.useFakeTimers();
  isLost = true;
  await expect(timeline.state(150)).rejects.toThrow("Failed to fetch");
  const before = reads;
  isLost = false;
  // During playback it is requested sixty times a second.
  for (let picture = 0; picture < 30; picture += 1) {
    expect(timeline.peek(150)).toBeUndefined();
    await vi.advanceTimersByTimeAsync(16);
  }
  expect(reads).toBe(before);
  await vi.advanceTimersByTimeAsync(1000);
  expect(timeline.peek(150)?.simTime).toBeCloseTo(1.5, 9);
  expect([...timeline.problems]).toEqual([]);
  isLost = true;
  await expect(Timeline.open([{ ...whole, read }])).rejects.toThrow("Failed to fetch");
});
