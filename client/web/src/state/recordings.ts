// The recordings of the daemon, and the one that is being made.
import { computed, signal } from "@preact/signals";

/** A recording on the daemon's disk. */
export interface RecordingInfo {
  name: string;
  state: "recording" | "complete" | "unfinished";
  /** Bytes of all its files. */
  bytes: number;
  files: { name: string; bytes: number }[];
  /** When it was last written to, by the daemon's clock: milliseconds since 1970. */
  modified: number;
}

/** Null until they were asked for. */
export const recordings = signal<readonly RecordingInfo[] | null>(null);
/** The one that is being made. */
export const beingMade = computed(() => recordings.value?.find(({ state }) => state === "recording"));
/** When it began, by the daemon's clock: milliseconds since 1970. Null where that is not known. */
export const recordingSince = signal<number | null>(null);
/** Whether the sheet with the list is open. */
export const recordingsOpen = signal(false);
