// The view settings of this page, kept in the local storage of the browser.
import { computed, effect, signal, type Signal } from "@preact/signals";
import type { Vector } from "./scene";

/** Light, dark, or the setting of the system. */
export type Theme = "system" | "light" | "dark";

/** Quality of the picture: "auto" depends on the frame rate. */
export type Quality = "auto" | "low" | "high";

/** A link of a robot. */
export interface LinkName {
  robot: string;
  link: string;
}

const PREFIX = "simd.view.";

/** A stored setting: its value, its default, and its valid values. */
export interface Kept {
  value: Signal<unknown>;
  initial: unknown;
  isValid: (value: unknown) => boolean;
}

/** All stored settings, by name. */
export const kept = new Map<string, Kept>();

/** A signal that is read from a storage of the browser and written back to it. */
function stored<T>(name: string, initial: T, isValid: (value: unknown) => value is T, storage = () => localStorage): Signal<T> {
  const value = signal<T>(read(name, initial, isValid, storage));
  kept.set(name, { value: value as Signal<unknown>, initial, isValid });
  effect(() => {
    try {
      storage().setItem(PREFIX + name, JSON.stringify(value.value));
    } catch {
      // Storage may be full or disabled; the page works without it.
    }
  });
  return value;
}

function read<T>(name: string, initial: T, isValid: (value: unknown) => value is T, storage: () => Storage): T {
  try {
    const value: unknown = JSON.parse(storage().getItem(PREFIX + name) ?? "null");
    return isValid(value) ? value : initial;
  } catch {
    return initial;
  }
}

const isBoolean = (value: unknown): value is boolean => typeof value === "boolean";
const isNumber = (value: unknown): value is number => typeof value === "number" && Number.isFinite(value);
const isString = (value: unknown): value is string => typeof value === "string";
const isTheme = (value: unknown): value is Theme => value === "system" || value === "light" || value === "dark";

export const visuals = stored("visuals", true, isBoolean);
export const collisions = stored("collisions", false, isBoolean);
export const frames = stored("frames", false, isBoolean);
export const grid = stored("grid", true, isBoolean);
export const contacts = stored("contacts", false, isBoolean);
export const constraintsShown = stored("constraints", true, isBoolean);
export const markersShown = stored("markers", true, isBoolean);
/** Names of the links of the robot in the panel. */
export const linkNames = stored("linkNames", false, isBoolean);
export const jointAxes = stored("jointAxes", false, isBoolean);
export const centresOfMass = stored("centresOfMass", false, isBoolean);
/** Points of lidars and range finders, and pictures of cameras, of the robot in the panel. */
export const pointsShown = stored("points", true, isBoolean);
/** Ellipsoids of the inertias of links. */
export const inertias = stored("inertias", false, isBoolean);
export const degrees = stored("degrees", false, isBoolean);
const isQuality = (value: unknown): value is Quality => value === "auto" || value === "low" || value === "high";
export const quality = stored<Quality>("quality", "auto", isQuality);
export const theme = stored<Theme>("theme", "system", isTheme);
export const plotsOpen = stored("plotsOpen", false, isBoolean);
export const panelOpen = stored("panelOpen", true, isBoolean);
/** Name of the robot that the panel shows; empty for the default. A robot of this name may not exist. */
export const selectedRobot = stored("selectedRobot", "", isString);

const isSlot = (value: unknown): value is [string, number] => Array.isArray(value) && value.length === 2 && isString(value[0]) && isNumber(value[1]);

/** Size of text and controls; "auto" depends on the width of the window. */
export type TextSize = "auto" | "100" | "125" | "150" | "200";
const TEXT_SIZES: readonly unknown[] = ["auto", "100", "125", "150", "200"] satisfies TextSize[];
export const textSize = stored<TextSize>("textSize", "auto", (value): value is TextSize => TEXT_SIZES.includes(value));
/** Width of the side panel in rem; null stands for the style sheet's width. */
export const panelWidth = stored<number | null>("panelWidth", null, (value): value is number | null => value === null || isNumber(value));

/** Part of a robot that the side panel shows. */
export type PanelPart = "joints" | "structure";
export const panelPart = stored<PanelPart>("panelPart", "joints", (value): value is PanelPart => value === "joints" || value === "structure");
/** Simulated seconds that the plots show. */
export const plotSpan = stored("plotSpan", 10, isNumber);
/** Keys and colour slots of the plotted axes, oldest first. */
export const plottedSlots = stored<readonly (readonly [string, number])[]>("plotted", [], (value): value is [string, number][] => Array.isArray(value) && value.every(isSlot));

/** Keys of the other plotted series; see `plots/series.ts`. */
export const plottedSeries = stored<readonly string[]>("series", [], (value): value is string[] => Array.isArray(value) && value.every(isString));
/** Whether contacts are drawn or plotted. */
export const contactsWanted = computed(() => contacts.value || plottedSeries.value.some((key) => key.startsWith("contact/")));

/** The position and the target of the camera, metres. */
export type CameraView = readonly [Vector, Vector];

const isVector = (value: unknown): value is Vector => Array.isArray(value) && value.length === 3 && value.every(isNumber);
const isView = (value: unknown): value is CameraView => Array.isArray(value) && value.length === 2 && value.every(isVector);
/**
 * Camera as the user has moved it; null if it is fitted to the scene. It is kept for this tab: another visit may find other
 * robots.
 */
export const cameraView = stored<CameraView | null>("camera", null, isView, () => sessionStorage);

/** Whether the picture is orthographic. */
export const orthographic = stored("orthographic", false, isBoolean, () => sessionStorage);
/** Small views from the front, the left and above, over the picture. */
export const sideViews = stored("sideViews", false, isBoolean);
/** Latest measurements of the robot in the panel, beside its sensors. */
export const readingsShown = stored("readings", false, isBoolean);
/** Name of the robot that the camera follows; empty without one. */
export const followed = signal("");

/** A side from which the world is seen; "corner" is from the front, the left and above. */
export type Viewpoint = "front" | "back" | "left" | "right" | "top" | "bottom" | "corner";

/** A move of the camera: angles in radians, `right` and `up` of "pan" as shares of the distance to the target. */
export type CameraMove =
  | { kind: "from"; viewpoint: Viewpoint }
  | { kind: "orbit"; right: number; up: number }
  | { kind: "pan"; right: number; up: number }
  | { kind: "zoom"; factor: number };

/** The newest requested move. */
export const cameraMove = signal<CameraMove | null>(null);

/** Moves the camera. */
export function moveCamera(move: CameraMove): void {
  // A new object, so that an equal move is made again.
  cameraMove.value = { ...move };
}

/** The link under the pointer, in the scene or in the panel. */
export const hoveredLink = signal<LinkName | null>(null);

/** A request to the scene to fit a robot, or everything if `robot` is empty. */
export const fitRequest = signal<{ robot: string; count: number }>({ robot: "", count: 0 });

/** Moves the camera such that a robot, or everything if the name is empty, fills the view. */
export function fit(robot = ""): void {
  fitRequest.value = { robot, count: fitRequest.value.count + 1 };
}
