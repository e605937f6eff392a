// Keys and mouse, for programs that ask for them: from the scene to the daemon.
import { signal } from "@preact/signals";

export type MouseButton = "left" | "middle" | "right";

/** User's action; x and y are from the left and the top of the picture, CSS pixels. */
export type PageInput =
  | { kind: "key"; key: string; code: string; isDown: boolean }
  /** Without a button it is a move. */
  | { kind: "mouse"; x: number; y: number; button: MouseButton | null; isDown: boolean };

/** Maximum number of waiting events; the oldest are dropped. */
const MAX = 256;

/** The program that asks for keys and mouse; null without one. */
export const inputFor = signal<string | null>(null);

/** Increases with each event. */
export const inputCount = signal(0);

let waiting: PageInput[] = [];

/** Adds an event. A move of the mouse replaces one right before it. */
export function pushInput(input: PageInput): void {
  const isMove = (it: PageInput | undefined): boolean => it?.kind === "mouse" && it.button === null;
  if (isMove(input) && isMove(waiting.at(-1))) waiting.pop();
  waiting.push(input);
  if (waiting.length > MAX) waiting.shift();
  inputCount.value += 1;
}

/** Takes all waiting events. */
export function takeInput(): PageInput[] {
  const taken = waiting;
  waiting = [];
  return taken;
}
