// Recent events of the world, in words.
import { signal } from "@preact/signals";

/** An event. */
export interface Happening {
  /** The daemon's sequence number of the event. */
  sequence: bigint;
  simTime: number;
  text: string;
  isWarning: boolean;
}

/** Maximum number of events. */
const MAX_KEPT = 100;

/** Newest first. */
export const happenings = signal<readonly Happening[]>([]);

/** Adds events, oldest first. */
export function addHappenings(newer: readonly Happening[]): void {
  if (newer.length > 0) happenings.value = [...newer.toReversed(), ...happenings.value].slice(0, MAX_KEPT);
}
