// Robot that the panel shows.
import { computed } from "@preact/signals";
import { selectedRobot } from "../state/view";
import { robots, type Robot } from "../state/world";

/** Returns the selected one, or the first that has joints. */
export const shownRobot = computed<Robot | undefined>(
  () => robots.value.find(({ name }) => name === selectedRobot.value) ?? robots.value.find(({ axes }) => axes.length > 0) ?? robots.value[0],
);
