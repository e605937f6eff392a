// Keyboard shortcuts, in a list that the help sheet shows too.
import { signal } from "@preact/signals";
import { playOrPause, reset, step } from "../daemon/actions";
import { inputFor } from "../state/input";
import { centresOfMass, collisions, constraintsShown, contacts, fit, followed, frames, grid, inertias, jointAxes, linkNames, markersShown, moveCamera, pointsShown, readingsShown, sideViews } from "../state/view";
import { orthographic, panelOpen, panelPart, plotsOpen, selectedRobot, visuals, type Viewpoint } from "../state/view";
import { pictureOpen } from "../state/picture";
import { playback } from "../state/playback";
import { askFirst, placing } from "../state/tools";
import { redo, undo } from "../state/undo";
import { robots, role } from "../state/world";
import { toggleRecording } from "./Recorder";
import { shownRobot } from "./shown-robot";

/** The open part of the help. */
export const helpOpen = signal<"begin" | "keys" | null>(null);

/** One or several keys with an action. */
interface Shortcut {
  /** As `KeyboardEvent.key`, in lower case. */
  keys: readonly string[];
  /** For the help sheet. */
  shown: string;
  what: string;
  /** Whether holding the key down repeats the action. */
  repeats?: boolean;
  run: (key: string, event: KeyboardEvent) => void;
}

function toggle(value: { value: boolean }): () => void {
  return () => {
    value.value = !value.value;
  };
}

/** Plays or pauses the recording that is shown; without one, the world. */
function playOrPauseShown(): void {
  const shown = playback.peek();
  if (shown) shown.player.toggle();
  else void playOrPause();
}

function stepRecording(key: string, { shiftKey }: KeyboardEvent): void {
  const player = playback.peek()?.player;
  const states = shiftKey && player ? Math.round(1 / player.timeline.period) : 1;
  player?.step(key === "arrowleft" ? -states : states);
}

/** Step of one key press for the camera: radians, shares of the distance, and a factor. */
const TURN = Math.PI / 36;
const SHIFT = 0.05;
const CLOSER = 0.9;

/** Arrow keys step through a recording if one is shown; otherwise they move the camera. */
function arrow(key: string, event: KeyboardEvent): void {
  const aside = { arrowleft: -1, arrowright: 1 }[key] ?? 0;
  const up = { arrowdown: -1, arrowup: 1 }[key] ?? 0;
  if (playback.peek() && aside !== 0) stepRecording(key, event);
  else if (event.shiftKey) moveCamera({ kind: "pan", right: aside * SHIFT, up: up * SHIFT });
  else moveCamera({ kind: "orbit", right: aside * TURN, up: up * TURN });
}

const SIDES: Readonly<Record<string, readonly [Viewpoint, Viewpoint]>> = { x: ["front", "back"], y: ["left", "right"], z: ["top", "bottom"] };

function lookAlong(key: string, { shiftKey }: KeyboardEvent): void {
  const viewpoint = SIDES[key]?.[shiftKey ? 1 : 0];
  if (viewpoint) moveCamera({ kind: "from", viewpoint });
}

/** Makes the camera follow the robot of the panel, or stop. */
export function toggleFollowing(): void {
  followed.value = followed.peek() === "" ? (shownRobot.peek()?.name ?? "") : "";
}

/** Resets the world; with other clients connected, after a question. */
export function askReset(): void {
  askFirst("Reset the world", "Set time to zero, and each robot to its first pose, for all clients.", "Reset", () => void reset());
}

function escape(): void {
  const shown = playback.peek();
  if (shown) shown.module.close();
  else placing.value = null;
}

function toggleStructure(): void {
  panelPart.value = panelOpen.peek() && panelPart.peek() === "structure" ? "joints" : "structure";
  panelOpen.value = true;
}

function chooseRobot(key: string): void {
  const robot = robots.peek()[Number(key) - 1];
  if (!robot) return;
  selectedRobot.value = robot.name;
  panelOpen.value = true;
}

function toFilter(): void {
  const filter = (): HTMLElement | null => document.getElementById("joint-filter");
  panelOpen.value = true;
  // Moves the focus at once if the element exists, since the next key may already be typed. It does not move
  // it again, since that key may be Tab.
  const found = filter();
  if (found) found.focus();
  else requestAnimationFrame(() => filter()?.focus());
}

/** All shortcuts of the page. */
export const SHORTCUTS: readonly Shortcut[] = [
  { keys: [" "], shown: "Space", what: "Play, pause; of a recording, if one is shown", run: playOrPauseShown },
  { keys: ["."], shown: ".", what: "One step", repeats: true, run: () => void step(1) },
  { keys: ["backspace"], shown: "Backspace", what: "Reset time and robots", run: askReset },
  { keys: [], shown: "Ctrl + Z", what: "Undo what this page changed; with Shift redo it", run: () => undefined },
  { keys: ["arrowleft", "arrowright", "arrowup", "arrowdown"], shown: "Arrows", what: "Orbit, with Shift pan; of a recording one state, with Shift a second", repeats: true, run: arrow },
  { keys: ["+", "=", "-"], shown: "+, -", what: "Zoom", repeats: true, run: (key) => moveCamera({ kind: "zoom", factor: key === "-" ? 1 / CLOSER : CLOSER }) },
  { keys: ["x", "y", "z"], shown: "X, Y, Z", what: "From the front, the left, above; with Shift from the other side", run: lookAlong },
  { keys: ["o"], shown: "O", what: "Orthographic, perspective", run: toggle(orthographic) },
  { keys: ["w"], shown: "W", what: "Views from the front, the left and above", run: toggle(sideViews) },
  { keys: ["t"], shown: "T", what: "Follow the robot of the panel", run: toggleFollowing },
  { keys: ["s"], shown: "S", what: "Save a picture", run: toggle(pictureOpen) },
  { keys: ["home", "end"], shown: "Home, End", what: "To the ends of a recording", run: (key) => playback.peek()?.player.seek(key === "home" ? 0 : Infinity) },
  { keys: ["escape"], shown: "Escape", what: "Close a recording; stop placing", run: escape },
  { keys: ["r"], shown: "R", what: "Record, stop", run: () => void (role.peek() !== "viewer" && toggleRecording()) },
  { keys: ["f"], shown: "F", what: "Fit everything into the view", run: () => fit() },
  { keys: ["v"], shown: "V", what: "Visuals", run: toggle(visuals) },
  { keys: ["c"], shown: "C", what: "Collision shapes", run: toggle(collisions) },
  { keys: ["j"], shown: "J", what: "Frames of links", run: toggle(frames) },
  { keys: ["g"], shown: "G", what: "Grid", run: toggle(grid) },
  { keys: ["k"], shown: "K", what: "Contacts", run: toggle(contacts) },
  { keys: ["l"], shown: "L", what: "Constraints", run: toggle(constraintsShown) },
  { keys: ["d"], shown: "D", what: "Markers", run: toggle(markersShown) },
  { keys: ["u"], shown: "U", what: "Hits and views of sensors", run: toggle(pointsShown) },
  { keys: ["q"], shown: "Q", what: "Readings of sensors", run: toggle(readingsShown) },
  { keys: ["n"], shown: "N", what: "Names of links, and the holders of claims", run: toggle(linkNames) },
  { keys: ["a"], shown: "A", what: "Axes of joints", run: toggle(jointAxes) },
  { keys: ["m"], shown: "M", what: "Centres of mass", run: toggle(centresOfMass) },
  { keys: ["e"], shown: "E", what: "Ellipsoids of inertia", run: toggle(inertias) },
  { keys: ["i"], shown: "I", what: "Structure of the robot in the panel", run: toggleStructure },
  { keys: ["p"], shown: "P", what: "Plots", run: toggle(plotsOpen) },
  { keys: ["b"], shown: "B", what: "Side panel", run: toggle(panelOpen) },
  { keys: ["/"], shown: "/", what: "Filter joints", run: toFilter },
  { keys: ["1", "2", "3", "4", "5", "6", "7", "8", "9"], shown: "1 … 9", what: "Show that robot", run: chooseRobot },
  { keys: ["?"], shown: "?", what: "Help: how to begin, and this list", run: () => void (helpOpen.value = helpOpen.peek() === null ? "keys" : null) },
];

/** Whether the focused element handles the key: a text field, a list, an open dialog. */
function isHandledBy(target: EventTarget | null, key: string): boolean {
  // These keys work with any focus: a button of a dialog loses it when it is pressed.
  if (document.querySelector("dialog[open]")) return key !== "?";
  if (!(target instanceof HTMLElement)) return false;
  if (target.isContentEditable || target.matches("textarea, select")) return true;
  if (target.matches("[role=tab], [role=separator], ul, ol") && key.startsWith("Arrow")) return true;
  // A joint's slider uses the arrow keys; the time line of a recording leaves them to the page.
  if (target instanceof HTMLInputElement) return target.type !== "range" || (isForSliders(key) && !target.closest(".time-line"));
  // An open popover is closed first.
  if (key === "Escape" && document.querySelector("[popover]:popover-open")) return true;
  // The space bar presses a focused button.
  return key === " " && target.matches("button, summary, a");
}

function isForSliders(key: string): boolean {
  return key.startsWith("Arrow") || key === "Home" || key === "End" || key === "Escape";
}

/**
 * Handles Ctrl + Z and Ctrl + Shift + Z, except in a field, which handles them. Returns whether it was one of
 * these.
 */
function takesBack(event: KeyboardEvent): boolean {
  if (!(event.ctrlKey || event.metaKey) || event.altKey || event.key.toLowerCase() !== "z") return false;
  if (inputFor.peek() !== null || isHandledBy(event.target, "z")) return false;
  event.preventDefault();
  void (event.shiftKey ? redo() : undo());
  return true;
}

/** Handles the keyboard until the returned function is called. */
export function listen(): () => void {
  const pressed = (event: KeyboardEvent): void => {
    if (event.defaultPrevented || event.isComposing) return;
    if (takesBack(event)) return;
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    // While a program asks for keys, the program receives them.
    if (inputFor.peek() !== null && event.key !== "?") return;
    if (isHandledBy(event.target, event.key)) return;
    const key = event.key.toLowerCase();
    const shortcut = SHORTCUTS.find(({ keys }) => keys.includes(key));
    if (!shortcut || (event.repeat && !shortcut.repeats)) return;
    event.preventDefault();
    shortcut.run(key, event);
  };
  // A button loses the focus after a click; otherwise the space bar would press it again.
  const released = (event: MouseEvent): void => {
    const button = event.target instanceof Element ? event.target.closest("button") : null;
    if (button && event.detail > 0 && !button.hasAttribute("popovertarget")) button.blur();
  };
  addEventListener("keydown", pressed);
  addEventListener("click", released);
  return () => {
    removeEventListener("keydown", pressed);
    removeEventListener("click", released);
  };
}
