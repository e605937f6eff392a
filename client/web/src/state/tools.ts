// Which tool for building the world is open. Its code is loaded with its first opening.
import { signal } from "@preact/signals";
import type { DroppedFile } from "../load/load";
import { clients } from "./world";

/** A sheet over the page. */
export type Tool =
  /** Options of dropped or chosen robots. */
  | { kind: "load"; files: DroppedFile[] }
  /** Shapes, ground and height fields. */
  | { kind: "add" }
  /** All robots: search, groups, what is hidden. */
  | { kind: "robots" }
  /** Saved states of the world. */
  | { kind: "saved-states" }
  /** One question before what concerns other clients too. */
  | { kind: "ask"; title: string; text: string; button: string; run: () => void };

export const tool = signal<Tool | null>(null);

/** Object that handles in the picture move: a robot by its root, or one of the two others. */
export interface Placing {
  robot: string;
  /** The link that the joints are to bring there. */
  link?: string;
  /** The joint that is turned or slid. */
  joint?: string;
}

export const placing = signal<Placing | null>(null);
/** Whether the handles move or turn. */
export const placingMode = signal<"translate" | "rotate">("translate");

/** Whether the pointer is on a handle or drags it: then it does nothing else. */
export const handleHeld = signal(false);

/** Names of the robots that this page does not draw. */
export const hiddenRobots = signal<ReadonlySet<string>>(new Set());

/** The names of the other clients that are here. */
export function othersHere(): string[] {
  return clients.value.filter(({ isCaller }) => !isCaller).map(({ name }) => name);
}

/** Asks the daemon who is here. */
let refreshClients: () => Promise<void> = () => Promise.resolve();

/** Says how the daemon is asked who is here. */
export function refreshClientsBy(refresh: () => Promise<void>): void {
  refreshClients = refresh;
}

let asking = false;

/**
 * Does what concerns other clients too: at once where there are none, else after a question that names them. While it is asked who
 * is here, a second click does nothing.
 */
export function askFirst(title: string, text: string, button: string, run: () => void): void {
  if (asking) return;
  asking = true;
  // Some may have come since the page last asked; where the daemon does not answer, the page says so elsewhere.
  const known = refreshClients().catch(() => undefined);
  void known.then(() => {
    asking = false;
    if (othersHere().length === 0) run();
    else tool.value = { kind: "ask", title, text, button, run };
  });
}
