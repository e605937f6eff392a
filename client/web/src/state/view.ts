// How this page shows the world: what people switch on and off, kept in the browser from visit to visit.
import { effect, signal, type Signal } from "@preact/signals";

/** Light and dark, or as the system has it. */
export type Theme = "system" | "light" | "dark";

/** A link of a robot. */
export interface LinkName {
  robot: string;
  link: string;
}

const PREFIX = "simd.view.";

/** A signal that is read from the browser's storage and written back to it. */
function kept<T extends string | boolean>(name: string, initial: T, fits: (value: unknown) => value is T): Signal<T> {
  const value = signal<T>(read(name, initial, fits));
  effect(() => {
    try {
      localStorage.setItem(PREFIX + name, JSON.stringify(value.value));
    } catch {
      // Storage may be full or forbidden; the page works without.
    }
  });
  return value;
}

function read<T>(name: string, initial: T, fits: (value: unknown) => value is T): T {
  try {
    const value: unknown = JSON.parse(localStorage.getItem(PREFIX + name) ?? "null");
    return fits(value) ? value : initial;
  } catch {
    return initial;
  }
}

const isBoolean = (value: unknown): value is boolean => typeof value === "boolean";
const isString = (value: unknown): value is string => typeof value === "string";
const isTheme = (value: unknown): value is Theme => value === "system" || value === "light" || value === "dark";

export const visuals = kept("visuals", true, isBoolean);
export const collisions = kept("collisions", false, isBoolean);
export const frames = kept("frames", false, isBoolean);
export const grid = kept("grid", true, isBoolean);
export const contacts = kept("contacts", false, isBoolean);
export const degrees = kept("degrees", false, isBoolean);
export const theme = kept<Theme>("theme", "system", isTheme);
export const plotsOpen = kept("plotsOpen", false, isBoolean);
export const panelOpen = kept("panelOpen", true, isBoolean);
/** Name of the robot that the panel shows; empty, or gone, for none chosen. */
export const selectedRobot = kept("selectedRobot", "", isString);
/** The link under the pointer, in the scene or in the panel. */
export const hoveredLink = signal<LinkName | null>(null);

/** Asks the scene to fit a robot, or all there is where `robot` is empty. */
export const fitRequest = signal<{ robot: string; count: number }>({ robot: "", count: 0 });

/** Puts the camera where the robot, or with an empty name everything, fills the view. */
export function fit(robot = ""): void {
  fitRequest.value = { robot, count: fitRequest.value.count + 1 };
}
