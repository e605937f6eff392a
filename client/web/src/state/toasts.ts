// Short messages about errors and results, which disappear automatically.
import { signal } from "@preact/signals";

/** One message. */
export interface Toast {
  id: number;
  kind: "error" | "info";
  sentence: string;
  /** Number of times that the same message was shown. */
  count: number;
}

/** Duration of each kind, milliseconds. */
const DURATION = { error: 8000, info: 4000 } as const;
/** Maximum number of messages at once. */
const MAX_TOASTS = 5;

export const toasts = signal<Toast[]>([]);

let lastId = 0;
const timers = new Map<number, ReturnType<typeof setTimeout>>();

/** Shows a message for a while. A message that is already shown is counted instead of shown twice. */
export function toast(kind: "error" | "info", sentence: string): void {
  const same = toasts.value.find((there) => there.kind === kind && there.sentence === sentence);
  if (same) {
    toasts.value = toasts.value.map((there) => (there === same ? { ...there, count: there.count + 1 } : there));
    expire(same.id, kind);
    return;
  }
  lastId += 1;
  toasts.value = [...toasts.value, { id: lastId, kind, sentence, count: 1 }].slice(-MAX_TOASTS);
  expire(lastId, kind);
}

/** Removes a message. */
export function dismiss(id: number): void {
  clearTimeout(timers.get(id));
  timers.delete(id);
  toasts.value = toasts.value.filter((there) => there.id !== id);
}

function expire(id: number, kind: "error" | "info"): void {
  clearTimeout(timers.get(id));
  timers.set(
    id,
    setTimeout(() => dismiss(id), DURATION[kind]),
  );
}
