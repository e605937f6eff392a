// Records joints from each state of the world, in memory: those that are plotted, and those that may be next.
import { computed, effect } from "@preact/signals";
import type { Quantity } from "../panels/quantity";
import { shownRobot } from "../panels/shown-robot";
import { frame, robots, type Axis, type Frame, type Mode } from "../state/world";
import { chosen } from "./chosen";
import { Samples } from "./samples";

/** Simulated seconds that are kept. */
export const SPAN = 60;
/** Of a world that plays slowly that many states, and not the whole span. */
const MOST = 40_000;

/** Of so many joints that are shown but not plotted: who plots one wants to see what it has just done. */
const SHOWN = 40;

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

interface Source {
  axis: Axis;
  part: Recorded;
}
const sources = computed<Map<string, Source>>(() => {
  const keys = chosen.value;
  const plotted = robots.value.flatMap((robot) => robot.axes.filter(({ key }) => keys.has(key)));
  const axes = new Set([...plotted, ...(shownRobot.value?.axes.slice(0, SHOWN) ?? [])]);
  return new Map([...axes].flatMap((axis) => PARTS.map((part) => [columnOf(axis.key, part), { axis, part }])));
});
let epoch: bigint | null = null;

effect(() => {
  const wanted = sources.value;
  for (const name of recording.names) {
    if (!wanted.has(name)) recording.remove(name);
  }
  for (const name of wanted.keys()) recording.add(name);
});

effect(() => {
  const now = frame.value;
  if (now) record(now);
});

/** Appends a state; begins anew where time went back. */
function record(now: Frame): void {
  if (epoch !== now.epoch) recording.clear();
  epoch = now.epoch;
  const from = sources.peek();
  if (from.size === 0) {
    recording.clear();
    return;
  }
  recording.push(now.simTime, (name) => {
    const source = from.get(name);
    return source ? valueOf(now, source) : NaN;
  });
}

function valueOf(now: Frame, { axis, part }: Source): number {
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
