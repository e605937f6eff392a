// Values of plotted series, and names with any characters.
import { beforeEach, expect, test } from "vitest";
import { readings, sensors, sensorsShownOf } from "../state/sensors";
import { parameters, robots, type Frame, type Robot } from "../state/world";
import { catalogue, valueOf } from "./series";

const crate: Robot = { name: "crate", model: "crate", layoutVersion: 1n, axes: [], links: ["body", "lid/50%"], disabledReason: "", claimedBy: "", mass: 1 };

function state(simTime: number, x: number, epoch = 0n): Frame {
  const half = Math.SQRT1_2;
  const poses = new Map([["crate", Float64Array.of(x, 2, 3, 0, 0, half, half, 5 * x, 0, 0, 0, 0, 0, 1)]]);
  const contact = { robotA: "ground", linkA: "link", robotB: "crate", linkB: "body", point: [0, 0, 0] as [number, number, number], normal: [0, 0, 1] as [number, number, number], depth: 0 };
  return { sequence: 1n, epoch, step: 1n, simTime, receivedAt: 0, joints: new Map(), poses, contacts: [{ ...contact, normalForce: 3 }, { ...contact, normalForce: 4 }, { ...contact, robotB: "other", normalForce: 9 }] };
}

beforeEach(() => {
  robots.value = [crate];
  parameters.value = [{ name: "a/b", kind: "slider", minimum: 0, maximum: 1, value: 0.25, presses: 0n, joint: "" }];
  sensors.value = [{ robot: "crate", name: "imu", kind: "imu", on: "body", rate: undefined, unavailable: "" }];
  sensorsShownOf.value = "crate";
  readings.value = new Map([["imu", { kind: "imu", acceleration: [0, 0, 9.81], angular: [1, 2, 3] }]]);
});

/** The value of the series with this label. */
function plotted(label: string, now = state(1, 0.5), before: Frame | null = null): number {
  const found = catalogue.value.find((series) => series.label === label);
  if (!found) throw new Error(`no ${label}`);
  return valueOf(found.key, now, before);
}

test("a base has a place and angles", () => {
  expect([plotted("base x"), plotted("base z")]).toEqual([0.5, 3]);
  expect(plotted("base yaw")).toBeCloseTo(Math.PI / 2, 12);
});

test("a link has a place, a velocity from one state to the next, and the sum of its contact forces", () => {
  expect(plotted("lid/50% x")).toBe(2.5);
  expect(plotted("lid/50% velocity x", state(1.5, 0.6), state(1, 0.5))).toBeCloseTo(1, 9);
  expect(plotted("lid/50% velocity x", state(1.5, 0.6, 1n), state(1, 0.5))).toBeNaN();
  expect(plotted("body contact force")).toBe(7);
  expect(plotted("lid/50% contact force")).toBe(0);
});

test("sensors, parameters and statistics are there by their names", () => {
  expect(plotted("imu acceleration z")).toBe(9.81);
  expect(plotted("imu angular y")).toBe(2);
  expect(plotted("a/b")).toBe(0.25);
  expect(plotted("real-time factor")).toBe(0);
});

test("a series of a deleted robot has no value", () => {
  const { key } = catalogue.value.find(({ label }) => label === "body x") ?? { key: "" };
  robots.value = [];
  expect(valueOf(key, state(1, 0.5), null)).toBeNaN();
  expect(valueOf("nonsense", state(1, 0.5), null)).toBeNaN();
});
