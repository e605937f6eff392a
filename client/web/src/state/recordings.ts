// The recordings of the daemon, and the current one.
import { computed, signal } from "@preact/signals";

/** A recording on the daemon's disk. */
export interface RecordingInfo {
  name: string;
  state: "recording" | "complete" | "unfinished";
  /** Bytes of all its files. */
  bytes: number;
  files: { name: string; bytes: number }[];
  /** Time of the last write by the daemon's clock: milliseconds since 1970. */
  modified: number;
}

/** Null until they are fetched. */
export const recordings = signal<readonly RecordingInfo[] | null>(null);
/** The current recording. */
export const beingMade = computed(() => recordings.value?.find(({ state }) => state === "recording"));
/** Start by the daemon's clock: milliseconds since 1970. Null if it is unknown. */
export const recordingSince = signal<number | null>(null);
/** Whether the sheet with the list is open. */
export const recordingsOpen = signal(false);
