// Reason why this page may not change something: its token has the role viewer, or another client has claimed it. Empty if
// it may.
import { computed, signal, type ReadonlySignal } from "@preact/signals";
import { robots, role, simulation, type Axis, type Robot } from "./world";

/** The name by which the daemon and other clients know this page. */
export const ownName = signal("");

/** Reason why this page may change nothing at all. */
export const whyNotChange: ReadonlySignal<string> = computed(() => (role.value === "viewer" ? "Your token has the role viewer, which can only look; this needs the role operator" : ""));

/** Reason against changes for all clients: the list of robots, how the world runs, its saved states. */
export const whyNotAll: ReadonlySignal<string> = computed(() => {
  if (role.value === null || role.value === "admin") return "";
  return `Your token has the role ${role.value === "viewer" ? "viewer, which can only look" : "operator"}; this needs the role admin`;
});

/** Whether a claim belongs to another client. */
function isOthers(holder: string): boolean {
  return holder !== "" && holder !== ownName.value;
}

/** Reason against changes of a robot as a whole: its position, its links, all of its joints. */
export function whyNotRobot({ name, claimedBy }: Pick<Robot, "name" | "claimedBy">, role = whyNotChange.value): string {
  if (role !== "") return role;
  return isOthers(claimedBy) ? `${claimedBy} has claimed ${name}: others can change it once it is released` : "";
}

/** Reason against removing a robot from the world. */
export function whyNotRemove(robot: Pick<Robot, "name" | "claimedBy">): string {
  return whyNotRobot(robot, whyNotAll.value);
}

/** Reason against setting the target of a joint. */
export function whyNotJoint({ label, claimedBy }: Pick<Axis, "label" | "claimedBy">): string {
  if (whyNotChange.value !== "") return whyNotChange.value;
  return isOthers(claimedBy) ? `${claimedBy} has claimed ${label}: others can set its target once it is released` : "";
}

/** Reason against single steps. */
export const whyNotStep: ReadonlySignal<string> = computed(() => {
  const { claimedBy } = simulation.value;
  if (whyNotAll.value !== "") return whyNotAll.value;
  return isOthers(claimedBy) ? `${claimedBy} has claimed the world: others can play, pause, step and reset it once it is released` : "";
});

/** Reason against changes for all clients: play, pause, reset, and the speed. */
export const whyNotWorld: ReadonlySignal<string> = computed(() => {
  const { claimedBy } = simulation.value;
  if (whyNotStep.value !== "" || claimedBy !== "") return whyNotStep.value;
  const taken = robots.value.find((robot) => isOthers(robot.claimedBy)) ?? robots.value.flatMap(({ axes }) => axes).find((axis) => isOthers(axis.claimedBy));
  if (!taken) return "";
  const what = "label" in taken ? taken.label : taken.name;
  return `${taken.claimedBy} has claimed ${what}: to play, pause or reset the world, claim it first with the lock beside these buttons`;
});
