// The title of the page, by which users find tabs and windows: the robot of the panel and the world.
import { effect } from "@preact/signals";
import { daemonName } from "../state/world";
import { printable } from "./printable";
import { shownRobot } from "./shown-robot";

/** Returns "arm · lab · simd", without missing parts. */
export function titleOf(robot: string | undefined, world: string): string {
  const parts = [robot ?? "", world, "simd"].filter((part, index, all) => part !== "" && all.indexOf(part) === index);
  return printable(parts.join(" · "));
}

/** Updates the title until the returned function is called. */
export function keepTitle(): () => void {
  return effect(() => {
    document.title = titleOf(shownRobot.value?.name, daemonName.value);
  });
}
