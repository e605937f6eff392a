// Keyboard shortcuts, in a list that the help sheet shows too.
import { signal } from "@preact/signals";
import { pause, play, reset, step } from "../daemon/actions";
import { collisions, constraintsShown, contacts, fit, frames, grid, markersShown, panelOpen, plotsOpen, selectedRobot, visuals } from "../state/view";
import { inputFor } from "../state/input";
import { playback } from "../state/playback";
import { robots, role, simulation } from "../state/world";
import { toggleRecording } from "./Recorder";

/** Whether the help sheet is open. */
export const helpOpen = signal(false);

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

/** Toggles between playing and paused. */
export function playOrPause(): void {
  void (simulation.peek().state === "playing" ? pause() : play());
}

/** The same of the recording that is shown, if there is one. */
function playOrPauseShown(): void {
  const shown = playback.peek();
  if (shown) shown.player.toggle();
  else playOrPause();
}

function stepRecording(key: string, { shiftKey }: KeyboardEvent): void {
  const player = playback.peek()?.player;
  const states = shiftKey && player ? Math.round(1 / player.timeline.period) : 1;
  player?.step(key === "arrowleft" ? -states : states);
}

function chooseRobot(key: string): void {
  const robot = robots.peek()[Number(key) - 1];
  if (!robot) return;
  selectedRobot.value = robot.name;
  panelOpen.value = true;
}

function toFilter(): void {
  const focus = (): void => document.getElementById("joint-filter")?.focus();
  panelOpen.value = true;
  // At once if it exists, since the next key may be typed already.
  focus();
  requestAnimationFrame(focus);
}

/** All shortcuts of the page. */
export const SHORTCUTS: readonly Shortcut[] = [
  { keys: [" "], shown: "Space", what: "Play, pause; of a recording, if one is shown", run: playOrPauseShown },
  { keys: ["."], shown: ".", what: "One step", repeats: true, run: () => void step(1) },
  { keys: ["backspace"], shown: "Backspace", what: "Reset time and robots", run: () => void reset() },
  { keys: ["arrowleft", "arrowright"], shown: "Left, Right", what: "One state of a recording; with Shift a second", repeats: true, run: stepRecording },
  { keys: ["home", "end"], shown: "Home, End", what: "To the ends of a recording", run: (key) => playback.peek()?.player.seek(key === "home" ? 0 : Infinity) },
  { keys: ["escape"], shown: "Escape", what: "Close a recording", run: () => playback.peek()?.module.close() },
  { keys: ["r"], shown: "R", what: "Record, stop", run: () => role.peek() !== "viewer" && toggleRecording() },
  { keys: ["f"], shown: "F", what: "Fit everything into the view", run: () => fit() },
  { keys: ["v"], shown: "V", what: "Visuals", run: toggle(visuals) },
  { keys: ["c"], shown: "C", what: "Collision shapes", run: toggle(collisions) },
  { keys: ["j"], shown: "J", what: "Frames of links", run: toggle(frames) },
  { keys: ["g"], shown: "G", what: "Grid", run: toggle(grid) },
  { keys: ["k"], shown: "K", what: "Contacts", run: toggle(contacts) },
  { keys: ["l"], shown: "L", what: "Constraints", run: toggle(constraintsShown) },
  { keys: ["m"], shown: "M", what: "Markers", run: toggle(markersShown) },
  { keys: ["p"], shown: "P", what: "Plots", run: toggle(plotsOpen) },
  { keys: ["b"], shown: "B", what: "Side panel", run: toggle(panelOpen) },
  { keys: ["/"], shown: "/", what: "Filter joints", run: toFilter },
  { keys: ["1", "2", "3", "4", "5", "6", "7", "8", "9"], shown: "1 … 9", what: "Show that robot", run: chooseRobot },
  { keys: ["?"], shown: "?", what: "This sheet", run: toggle(helpOpen) },
];

/** Whether the focused element handles the key: a text field, a list, an open dialog. */
function isHandledBy(target: EventTarget | null, key: string): boolean {
  if (!(target instanceof HTMLElement)) return false;
  if (target.closest("dialog[open]")) return key !== "?";
  if (target.isContentEditable || target.matches("textarea, select")) return true;
  if (target.matches("[role=tab]") && key.startsWith("Arrow")) return true;
  // A slider of a joint has the arrows to itself; the time line of a recording has those of the page.
  if (target instanceof HTMLInputElement) return target.type !== "range" || (isForSliders(key) && !target.closest(".time-line"));
  // An open popover is closed first.
  if (key === "Escape" && document.querySelector("[popover]:popover-open")) return true;
  // The space bar presses a focused button.
  return key === " " && target.matches("button, summary, a");
}

function isForSliders(key: string): boolean {
  return key.startsWith("Arrow") || key === "Home" || key === "End" || key === "Escape";
}

/** Handles the keyboard until the returned function is called. */
export function listen(): () => void {
  const pressed = (event: KeyboardEvent): void => {
    if (event.defaultPrevented || event.isComposing || event.ctrlKey || event.altKey || event.metaKey) return;
    // While a program asks for keys they are its own.
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
