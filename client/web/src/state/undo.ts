// Changes of the world by this page that it can undo, newest last.
import { signal } from "@preact/signals";
import { toast } from "./toasts";

/** Maximum number of changes. */
const MAX = 100;
/** Milliseconds within which changes of one thing count as one. */
const TOGETHER = 1000;

/** One change. Both functions reject with a sentence for the user if the change is no longer possible. */
export interface Change {
  /** "moving crate". */
  what: string;
  undo: () => Promise<unknown>;
  redo: () => Promise<unknown>;
  /** Key of the changed thing: changes of one thing within a second are one. */
  of?: string;
}

interface Kept extends Change {
  at: number;
}

export const past = signal<readonly Kept[]>([]);
export const future = signal<readonly Kept[]>([]);
/**
 * Promise of the current undo or redo. They run one after the other, since the second may need the result of
 * the first.
 */
let acting: Promise<void> = Promise.resolve();
/** Changes that the daemon has not answered yet. */
const underWay = new Set<Promise<unknown>>();

/** Marks a change as under way until it ends: an undo waits for it, since only then the change is noted. Returns it. */
export function making<T>(change: Promise<T>): Promise<T> {
  underWay.add(change);
  const end = (): void => void underWay.delete(change);
  change.then(end, end);
  return change;
}

/**
 * Notes a change that was made at `now`, milliseconds. Changes that were undone before can no longer be
 * redone.
 */
export function changed(change: Change, now = performance.now()): void {
  const last = past.peek().at(-1);
  future.value = [];
  if (last && change.of !== undefined && last.of === change.of && now - last.at < TOGETHER) {
    past.value = [...past.peek().slice(0, -1), { ...change, undo: last.undo, at: now }];
    return;
  }
  past.value = [...past.peek(), { ...change, at: now }].slice(-MAX);
}

/** Undoes the newest change. */
export function undo(): Promise<void> {
  return turn(past, future, (change) => change.undo(), "undone");
}

/** Redoes the change that was undone last. */
export function redo(): Promise<void> {
  return turn(future, past, (change) => change.redo(), "redone");
}

type List = typeof past;

function turn(from: List, to: List, act: (change: Change) => Promise<unknown>, word: string): Promise<void> {
  const before = [...underWay];
  acting = acting.then(async () => {
    if (before.length > 0) await Promise.allSettled(before);
    await turnOne(from, to, act, word);
  });
  return acting;
}

async function turnOne(from: List, to: List, act: (change: Change) => Promise<unknown>, word: string): Promise<void> {
  const change = from.peek().at(-1);
  if (!change) return;
  from.value = from.peek().slice(0, -1);
  try {
    await act(change);
    to.value = [...to.peek(), { ...change, at: -Infinity }];
    toast("info", `${capital(change.what)} was ${word}.`);
  } catch (error) {
    const why = error instanceof Error ? error.message : String(error);
    toast("error", `${capital(change.what)} cannot be ${word}: ${why}`);
  }
}

function capital(text: string): string {
  return text.charAt(0).toUpperCase() + text.slice(1);
}
