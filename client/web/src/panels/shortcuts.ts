// What keys do, in one list that the help sheet shows as well.
import { signal } from "@preact/signals";
import { pause, play, reset, step } from "../daemon/actions";
import { collisions, contacts, fit, frames, grid, panelOpen, plotsOpen, selectedRobot, visuals } from "../state/view";
import { robots, simulation } from "../state/world";

/** Whether the help sheet is open. */
export const helpOpen = signal(false);

/** A key, or several that do alike. */
interface Shortcut {
  /** As `KeyboardEvent.key`; letters in small. */
  keys: readonly string[];
  /** As it is written for people. */
  shown: string;
  what: string;
  /** Whether holding the key down does it again. */
  repeats?: boolean;
  run: (key: string) => void;
}

function flip(value: { value: boolean }): () => void {
  return () => {
    value.value = !value.value;
  };
}

/** Plays, or pauses where it plays. */
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
  // At once where it is there: what is typed next belongs to it.
  focus();
  requestAnimationFrame(focus);
}

/** All keys of the page. */
export const SHORTCUTS: readonly Shortcut[] = [
  { keys: [" "], shown: "Space", what: "Play, pause", run: playOrPause },
  { keys: ["."], shown: ".", what: "One step", repeats: true, run: () => void step(1) },
  { keys: ["backspace"], shown: "Backspace", what: "Reset time and robots", run: () => void reset() },
  { keys: ["f"], shown: "F", what: "Fit everything into the view", run: () => fit() },
  { keys: ["v"], shown: "V", what: "Visuals", run: flip(visuals) },
  { keys: ["c"], shown: "C", what: "Collision shapes", run: flip(collisions) },
  { keys: ["j"], shown: "J", what: "Frames of links", run: flip(frames) },
  { keys: ["g"], shown: "G", what: "Grid", run: flip(grid) },
  { keys: ["k"], shown: "K", what: "Contacts", run: flip(contacts) },
  { keys: ["p"], shown: "P", what: "Plots", run: flip(plotsOpen) },
  { keys: ["b"], shown: "B", what: "Side panel", run: flip(panelOpen) },
  { keys: ["/"], shown: "/", what: "Filter joints", run: toFilter },
  { keys: ["1", "2", "3", "4", "5", "6", "7", "8", "9"], shown: "1 … 9", what: "Show that robot", run: chooseRobot },
  { keys: ["?"], shown: "?", what: "This sheet", run: flip(helpOpen) },
];

/** Whether keys belong to what has the focus: a field that is typed into, a list, an open dialog. */
function isTaken(target: EventTarget | null, key: string): boolean {
  if (!(target instanceof HTMLElement)) return false;
  if (target.closest("dialog[open]")) return key !== "?";
  if (target.isContentEditable || target.matches("textarea, select")) return true;
  if (target instanceof HTMLInputElement) return target.type !== "range";
  // A button that has the focus is pressed with the space bar.
  return key === " " && target.matches("button, summary, a");
}

/** Listens to the keyboard until the answer is called. */
export function listen(): () => void {
  const pressed = (event: KeyboardEvent): void => {
    if (event.defaultPrevented || event.isComposing || event.ctrlKey || event.altKey || event.metaKey) return;
    if (isTaken(event.target, event.key)) return;
    const key = event.key.toLowerCase();
    const shortcut = SHORTCUTS.find(({ keys }) => keys.includes(key));
    if (!shortcut || (event.repeat && !shortcut.repeats)) return;
    event.preventDefault();
    shortcut.run(key);
  };
  // A button that was pressed with the pointer gives the focus back: else the next space bar would press it again.
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
