// Recording of the world, and the file that is made from it.
import { beforeEach, expect, test } from "vitest";
import { frame, robots, type Axis, type Frame, type JointValues, type Mode } from "../state/world";
import { plottedSlots } from "../state/view";
import { addPlot, plotted, MAX_PLOTTED, removePlot } from "./plotted";
import { asCsv } from "./export";
import { columnOf, recording } from "./recorder";

const axis = (joint: string, index: number): Axis => ({
  key: `arm/${joint}`, robot: "arm", joint, axis: 0, label: joint, kind: "angle",
  positionIndex: index, velocityIndex: index, childLink: joint, actuated: true, claimedBy: "",
});
const axes = Array.from({ length: 10 }, (_, index) => axis(`j${index}`, index));

function show(simTime: number, mode: Mode = "position", epoch = 0n): void {
  const each = (value: number): number[] => axes.map((_, index) => value + index);
  const values: JointValues = { position: each(simTime), velocity: each(10), effort: each(20), target: each(30), mode: axes.map(() => mode), flags: each(0) };
  const now: Frame = { sequence: 0n, epoch, step: 0n, simTime, receivedAt: 0, joints: new Map([["arm", values]]), poses: new Map(), contacts: [] };
  frame.value = now;
}

beforeEach(() => {
  frame.value = null;
  robots.value = [{ name: "arm", model: "arm", layoutVersion: 1n, axes, links: [], disabledReason: "", claimedBy: "", mass: 1 }];
  plottedSlots.value = [];
  recording.clear();
});

test("the joints of the robot that is shown are recorded before a plot shows them", () => {
  for (const time of [0, 0.1, 0.2]) show(time);
  addPlot("arm/j1");
  expect([...recording.column(columnOf("arm/j1", "position"))]).toEqual([1, 1.1, 1.2]);
});

test("only plotted joints are recorded for robots that are not shown", () => {
  const other = { ...axis("k", 0), key: "other/k", robot: "other" };
  const idle = { ...axis("l", 0), key: "other/l", robot: "other" };
  robots.value = [...robots.value, { name: "other", model: "", layoutVersion: 1n, axes: [other, idle], links: [], disabledReason: "", claimedBy: "", mass: 1 }];
  addPlot("other/k");
  show(0);
  expect(recording.names).toContain(columnOf("other/k", "target"));
  expect(recording.names).not.toContain(columnOf("other/l", "target"));
  removePlot("other/k");
  expect(recording.names).not.toContain(columnOf("other/k", "target"));
});

test("a reset clears the recording, even if time did not go back", () => {
  addPlot("arm/j0");
  for (const time of [0, 0.1]) show(time);
  show(0.2, "position", 1n);
  expect([...recording.times()]).toEqual([0.2]);
});

test("a deleted robot leaves no figures", () => {
  addPlot("arm/j0");
  show(0);
  robots.value = [];
  show(0.1);
  expect(recording.names).toEqual([]);
});

test("no two plotted joints have one colour, and the oldest makes room", () => {
  for (const { key } of axes) addPlot(key);
  expect(plotted.value.size).toBe(MAX_PLOTTED);
  expect(new Set(plotted.value.values()).size).toBe(MAX_PLOTTED);
  expect(plotted.value.has("arm/j0")).toBe(false);
  expect(plotted.value.has("arm/j9")).toBe(true);
});

test("the file has units in its header, and no target if nothing drives the joint", () => {
  addPlot("arm/j1");
  show(0);
  show(0.5, "passive");
  expect(asCsv(recording, [axes[1] as Axis]).split("\r\n")).toEqual([
    "sim_time [s],arm/j1.position [rad],arm/j1.velocity [rad/s],arm/j1.effort [N m],arm/j1.target [rad],arm/j1.mode",
    "0,1,11,21,31,position",
    "0.5,1.5,11,21,,passive",
    "",
  ]);
});

test("if the mode changed, no single unit fits the target, and the header says so", () => {
  addPlot("arm/j0");
  show(0);
  show(0.5, "velocity");
  expect(asCsv(recording, [axes[0] as Axis])).toContain("arm/j0.target [as .mode says]");
});
