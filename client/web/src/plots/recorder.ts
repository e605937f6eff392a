// Recorder of joints from each state, in memory: plotted joints, and joints of the shown robot.
import { computed, effect } from "@preact/signals";
import type { Quantity } from "../panels/quantity";
import { shownRobot } from "../panels/shown-robot";
import { axisValues } from "../state/joint-values";
import { frame, robots, type Axis, type Frame, type Mode } from "../state/world";
import { plotted } from "./plotted";
import { Samples } from "./samples";

/** Simulated seconds that are kept. */
export const SPAN = 60;
/** Upper bound of the number of states, which is reached when the world plays slowly. */
const MAX_SAMPLES = 40_000;

/** Upper bound of joints that are recorded without being plotted, so that a new plot has a past. */
const MAX_UNPLOTTED = 40;

/** Recorded quantities of a joint. */
export type Recorded = Quantity | "target" | "mode";
const PARTS: readonly Recorded[] = ["position", "velocity", "effort", "target", "mode"];
/** A mode is recorded as its index here. */
export const MODES: readonly Mode[] = ["none", "passive", "position", "hold", "velocity", "effort"];

/** Name of a column. */
export function columnOf(key: string, part: Recorded): string {
  return `${key} ${part}`;
}

/** The recording. */
export const recording = new Samples(SPAN, MAX_SAMPLES);

interface Source {
  axis: Axis;
  part: Recorded;
}
const sources = computed<Map<string, Source>>(() => {
  const keys = plotted.value;
  const ofPlots = robots.value.flatMap((robot) => robot.axes.filter(({ key }) => keys.has(key)));
  const axes = new Set([...ofPlots, ...(shownRobot.value?.axes.slice(0, MAX_UNPLOTTED) ?? [])]);
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

/** Appends a state; clears the recording if time went back. */
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
  const own = joints && axisValues(axis, joints);
  if (!own) return NaN;
  return part === "mode" ? MODES.indexOf(own.mode) : own[part];
}
