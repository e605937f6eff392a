// The open tool for building the world. Its code is loaded with its first opening.
import { signal } from "@preact/signals";
import type { DroppedFile } from "../load/load";
import { clients } from "./world";

/** A sheet over the page. */
export type Tool =
  /** Options of dropped or chosen robots. */
  | { kind: "load"; files: DroppedFile[] }
  /** Shapes, ground and height fields. */
  | { kind: "add" }
  /** List of all robots: search, groups, hidden robots. */
  | { kind: "robots" }
  /** Saved states of the world. */
  | { kind: "saved-states" }
  /** One question before changes that concern other clients too. */
  | { kind: "ask"; title: string; text: string; button: string; run: () => void };

export const tool = signal<Tool | null>(null);

/** Object that handles in the picture move: a robot by its root, or one of the two others. */
export interface Placing {
  robot: string;
  /** The link that the joints are to move there. */
  link?: string;
  /** The joint that is turned or slid. */
  joint?: string;
}

export const placing = signal<Placing | null>(null);
/** Whether the handles move or turn. */
export const placingMode = signal<"translate" | "rotate">("translate");

/** Whether the pointer is on a handle or drags it: then it has no other function. */
export const handleHeld = signal(false);

/** Names of the robots that are hidden on this page. */
export const hiddenRobots = signal<ReadonlySet<string>>(new Set());

/** Returns names of the other connected clients. */
export function othersHere(): string[] {
  return clients.value.filter(({ isCaller }) => !isCaller).map(({ name }) => name);
}

/** Asks the daemon for the connected clients. */
let refreshClients: () => Promise<void> = () => Promise.resolve();

/** Sets the function that asks the daemon for the connected clients. */
export function refreshClientsBy(refresh: () => Promise<void>): void {
  refreshClients = refresh;
}

let asking = false;

/**
 * Runs a change that concerns other clients too: at once without any, else after a question that names them. While the list is
 * fetched, a second click does nothing.
 */
export function askFirst(title: string, text: string, button: string, run: () => void): void {
  if (asking) return;
  asking = true;
  // Clients may have connected since the last request; if the daemon does not answer, the page reports it elsewhere.
  const known = refreshClients().catch(() => undefined);
  void known.then(() => {
    asking = false;
    if (othersHere().length === 0) run();
    else tool.value = { kind: "ask", title, text, button, run };
  });
}
