// Records the plotted joints from each state of the world, in memory, for as long as they are plotted.
import { effect } from "@preact/signals";
import type { Quantity } from "../panels/quantity";
import { frame, robots, type Axis, type Frame, type Mode } from "../state/world";
import { chosen } from "./chosen";
import { Samples } from "./samples";

/** Simulated seconds that are kept. */
export const SPAN = 60;
/** Of a world that plays slowly that many states, and not the whole span. */
const MOST = 40_000;

/** What is recorded of a joint. */
export type Recorded = Quantity | "target" | "mode";
const PARTS: readonly Recorded[] = ["position", "velocity", "effort", "target", "mode"];
/** A mode is recorded as its index here. */
export const MODES: readonly Mode[] = ["none", "passive", "position", "hold", "velocity", "effort"];

/** Name of a column. */
export function columnOf(key: string, part: Recorded): string {
  return `${key} ${part}`;
}

/** What was recorded until now. */
export const recording = new Samples(SPAN, MOST);

let columns: { name: string; axis: Axis; part: Recorded }[] = [];
let epoch: bigint | null = null;

effect(() => {
  const keys = chosen.value;
  const axes = robots.value.flatMap((robot) => robot.axes.filter(({ key }) => keys.has(key)));
  columns = axes.flatMap((axis) => PARTS.map((part) => ({ name: columnOf(axis.key, part), axis, part })));
  const wanted = new Set(columns.map(({ name }) => name));
  for (const name of recording.names) {
    if (!wanted.has(name)) recording.remove(name);
  }
  for (const name of wanted) recording.add(name);
});

effect(() => {
  const now = frame.value;
  if (now) record(now);
});

/** Appends a state; begins anew where time went back. */
function record(now: Frame): void {
  if (epoch !== now.epoch) recording.clear();
  epoch = now.epoch;
  if (columns.length === 0) {
    recording.clear();
    return;
  }
  const values = new Map<string, number>();
  for (const { name, axis, part } of columns) values.set(name, valueOf(now, axis, part));
  recording.push(now.simTime, (name) => values.get(name) ?? NaN);
}

function valueOf(now: Frame, axis: Axis, part: Recorded): number {
  const joints = now.joints.get(axis.robot);
  if (!joints) return NaN;
  switch (part) {
    case "position":
      return joints.position[axis.positionIndex] ?? NaN;
    case "mode":
      return MODES.indexOf(joints.mode[axis.velocityIndex] ?? "none");
    default:
      return joints[part][axis.velocityIndex] ?? NaN;
  }
}
