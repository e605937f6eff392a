// The order in which a recording is read for its plots, and the result.
import { expect, test } from "vitest";
import { positionOf, recording } from "../recording/fixture";
import { fileSource } from "../recording/source";
import { Timeline } from "../recording/timeline";
import type { Axis } from "../state/world";
import { Overview, spread } from "./overview";

test("all numbers come once, the first of them far from each other", () => {
  for (const count of [0, 1, 2, 7, 64, 100]) {
    const order = [...spread(count)];
    expect(order.toSorted((a, b) => a - b)).toEqual(Array.from({ length: count }, (_, at) => at));
  }
  expect([...spread(8)].slice(0, 4)).toEqual([0, 4, 2, 6]);
});

test("a line has the recorded values at their times", async () => {
  const bytes = await recording({ states: 50 });
  const timeline = await Timeline.open([fileSource(Object.assign(new Blob([bytes]), { name: "run.mcap" }))]);
  const axis = { key: "arm-1/elbow", robot: "arm-1", joint: "elbow" } as Axis;
  let changes = 0;
  const overview = new Overview(timeline, [axis], () => (changes += 1));
  expect(await overview.read()).toBe(true);
  expect(changes).toBeGreaterThan(0);
  const values = overview.column("arm-1/elbow position");
  expect(values.length).toBe(50);
  for (const at of values.keys()) {
    expect(values[at]).toBe(positionOf(at));
    expect(overview.times()[at]).toBeCloseTo(at / 100, 9);
  }
  expect(overview.column("arm-1/elbow target").length).toBe(0);
}, 60_000);
