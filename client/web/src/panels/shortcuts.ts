// Keyboard shortcuts, in a list that the help sheet shows too.
import { signal } from "@preact/signals";
import { pause, play, reset, step } from "../daemon/actions";
import { collisions, contacts, fit, frames, grid, panelOpen, plotsOpen, selectedRobot, visuals } from "../state/view";
import { robots, simulation } from "../state/world";

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
  run: (key: string) => void;
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
  { keys: [" "], shown: "Space", what: "Play, pause", run: playOrPause },
  { keys: ["."], shown: ".", what: "One step", repeats: true, run: () => void step(1) },
  { keys: ["backspace"], shown: "Backspace", what: "Reset time and robots", run: () => void reset() },
  { keys: ["f"], shown: "F", what: "Fit everything into the view", run: () => fit() },
  { keys: ["v"], shown: "V", what: "Visuals", run: toggle(visuals) },
  { keys: ["c"], shown: "C", what: "Collision shapes", run: toggle(collisions) },
  { keys: ["j"], shown: "J", what: "Frames of links", run: toggle(frames) },
  { keys: ["g"], shown: "G", what: "Grid", run: toggle(grid) },
  { keys: ["k"], shown: "K", what: "Contacts", run: toggle(contacts) },
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
  if (target instanceof HTMLInputElement) return target.type !== "range";
  // The space bar presses a focused button.
  return key === " " && target.matches("button, summary, a");
}

/** Handles the keyboard until the returned function is called. */
export function listen(): () => void {
  const pressed = (event: KeyboardEvent): void => {
    if (event.defaultPrevented || event.isComposing || event.ctrlKey || event.altKey || event.metaKey) return;
    if (isHandledBy(event.target, event.key)) return;
    const key = event.key.toLowerCase();
    const shortcut = SHORTCUTS.find(({ keys }) => keys.includes(key));
    if (!shortcut || (event.repeat && !shortcut.repeats)) return;
    event.preventDefault();
    shortcut.run(key);
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
