// Quantities that can be plotted in addition to joints: positions and speeds of links, contact forces, readings of sensors, parameters
// and statistics.
import { computed } from "@preact/signals";
import { shownRobot } from "../panels/shown-robot";
import { rollPitchYaw } from "../state/joint-values";
import { readings, sensors, sensorsShownOf, type Measurement, type SensorKind } from "../state/sensors";
import { parameters, robots, simulation, type Frame } from "../state/world";

/** A series that can be chosen. */
export interface Series {
  /** Kept in the browser: kind, then names. */
  key: string;
  /** Heading of its group in the list. */
  group: string;
  label: string;
  /** Series of one unit share a plot; empty is a plain number. */
  unit: string;
}

/** Maximum number of links of a robot that are offered. */
const MAX_LINKS = 200;

const AXES = ["x", "y", "z"] as const;
const ANGLES = ["roll", "pitch", "yaw"] as const;

const MOTION: readonly (readonly [string, string])[] = [...AXES.map((axis) => [axis, "m"] as const), ...AXES.map((axis) => [`linear ${axis}`, "m/s"] as const)];

/** Names of the numbers of a sensor, with their units. */
const CHANNELS: Partial<Record<SensorKind, readonly (readonly [string, string])[]>> = {
  imu: [...AXES.map((axis) => [`acceleration ${axis}`, "m/s²"] as const), ...AXES.map((axis) => [`angular ${axis}`, "rad/s"] as const)],
  "force-torque": [...AXES.map((axis) => [`force ${axis}`, "N"] as const), ...AXES.map((axis) => [`torque ${axis}`, "N m"] as const)],
  contact: [["normal force", "N"]],
  range: [["range", "m"]],
  lidar: [["nearest", "m"]],
  encoder: [
    ["position", "rad or m"],
    ["velocity", "rad/s or m/s"],
  ],
  "link state": MOTION,
  odometry: MOTION,
};

/** Returns all series that can be plotted now: the bases of all robots, and links and sensors of the panel's robot. */
export const catalogue = computed<Series[]>(() => [
  ...robots.value.flatMap(({ name, links }) => [
    ...AXES.map((axis): Series => ({ key: key("base", name, axis), group: name, label: `base ${axis}`, unit: "m" })),
    ...ANGLES.map((axis): Series => ({ key: key("base", name, axis), group: name, label: `base ${axis}`, unit: "rad" })),
    ...(name === shownRobot.value?.name ? links.slice(0, MAX_LINKS) : []).flatMap((link): Series[] => [
      ...AXES.map((axis) => ({ key: key("link", name, link, axis), group: `${name}: links`, label: `${link} ${axis}`, unit: "m" })),
      ...AXES.map((axis) => ({ key: key("link", name, link, `v${axis}`), group: `${name}: links`, label: `${link} velocity ${axis}`, unit: "m/s" })),
      { key: key("contact", name, link), group: `${name}: contacts`, label: `${link} contact force`, unit: "N" },
    ]),
  ]),
  ...sensors.value
    .filter(({ robot, unavailable }) => robot === sensorsShownOf.value && unavailable === "")
    .flatMap(({ robot, name, kind }) =>
      (CHANNELS[kind] ?? []).map(([channel, unit]): Series => ({ key: key("sensor", robot, name, channel), group: `${robot}: sensors`, label: `${name} ${channel}`, unit })),
    ),
  ...parameters.value.filter(({ kind }) => kind === "slider").map(({ name }): Series => ({ key: key("parameter", name), group: "Parameters", label: name, unit: "" })),
  { key: key("statistics", "factor"), group: "World", label: "real-time factor", unit: "" },
  { key: key("statistics", "step"), group: "World", label: "time of a step", unit: "ms" },
]);

function key(...parts: string[]): string {
  return parts.map((part) => part.replaceAll("%", "%25").replaceAll("/", "%2F")).join("/");
}

/** The parts of a key. */
export function partsOf(text: string): string[] {
  return text.split("/").map((part) => part.replaceAll("%2F", "/").replaceAll("%25", "%"));
}

/** Returns the value of the series in a state; `before` is the state before it, for speeds. NaN if it has none. */
export function valueOf(text: string, now: Frame, before: Frame | null): number {
  const [kind = "", robot = "", name = "", channel = ""] = partsOf(text);
  switch (kind) {
    case "base":
      return ofPose(now.poses.get(robot)?.subarray(0, 7), name);
    case "link":
      return ofLink(now, before, robot, name, channel);
    case "contact":
      return contactForce(now, robot, name);
    case "sensor": {
      const measured = robot === sensorsShownOf.peek() ? readings.peek().get(name) : undefined;
      return measured ? channelOf(measured, channel) : NaN;
    }
    case "parameter":
      return parameters.peek().find((each) => each.name === robot)?.value ?? NaN;
    case "statistics":
      return robot === "factor" ? simulation.peek().actual : 1e3 * simulation.peek().stepDuration;
    default:
      return NaN;
  }
}

function ofPose(pose: Float64Array | undefined, name: string): number {
  if (pose?.length !== 7) return NaN;
  const index = AXES.findIndex((axis) => axis === name);
  if (index >= 0) return pose[index] ?? NaN;
  const [, , , x = 0, y = 0, z = 0, w = 1] = pose;
  return rollPitchYaw([x, y, z, w])[ANGLES.findIndex((axis) => axis === name)] ?? NaN;
}

/** Returns its position; or its velocity, from its displacement since the state before. */
function ofLink(now: Frame, before: Frame | null, robot: string, link: string, name: string): number {
  const index = robots.peek().find((each) => each.name === robot)?.links.indexOf(link) ?? -1;
  if (index < 0) return NaN;
  const at = (frame: Frame, axis: string): number => ofPose(frame.poses.get(robot)?.subarray(7 * index, 7 * index + 7), axis);
  if (!name.startsWith("v")) return at(now, name);
  const time = before && before.epoch === now.epoch ? now.simTime - before.simTime : 0;
  return before && time > 0 ? (at(now, name.slice(1)) - at(before, name.slice(1))) / time : NaN;
}

/** The sum of the normal forces on a link, N. */
function contactForce({ contacts }: Frame, robot: string, link: string): number {
  let sum = 0;
  for (const { robotA, linkA, robotB, linkB, normalForce } of contacts) {
    if ((robotA === robot && linkA === link) || (robotB === robot && linkB === link)) sum += normalForce;
  }
  return sum;
}

function channelOf(measured: Measurement, channel: string): number {
  const [what = "", axis = ""] = channel.split(" ");
  const index = AXES.findIndex((each) => each === axis);
  switch (measured.kind) {
    case "imu":
      return (what === "acceleration" ? measured.acceleration : measured.angular)[index] ?? NaN;
    case "force-torque":
      return (what === "force" ? measured.force : measured.torque)[index] ?? NaN;
    case "contact":
      return measured.normalForce;
    case "range":
      return measured.range;
    case "lidar":
      return measured.nearest;
    case "encoder":
      return what === "position" ? measured.position : measured.velocity;
    case "motion":
      return (what === "linear" ? measured.linear[index] : measured.position[AXES.findIndex((each) => each === what)]) ?? NaN;
    case "unknown":
      return NaN;
  }
}
