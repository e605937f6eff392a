// Short messages that come and go: what was refused, what was done.
import { signal } from "@preact/signals";

/** One message. */
export interface Toast {
  id: number;
  kind: "error" | "info";
  sentence: string;
  /** How often it was said again while it was there. */
  count: number;
}

/** How long each kind stays, milliseconds. */
const STAYS = { error: 8000, info: 4000 } as const;
/** More than this at once nobody reads. */
const MOST = 5;

export const toasts = signal<Toast[]>([]);

let lastId = 0;
const timers = new Map<number, ReturnType<typeof setTimeout>>();

/** Shows a sentence for a while. One that is already there is counted instead of shown twice. */
export function toast(kind: "error" | "info", sentence: string): void {
  const same = toasts.value.find((there) => there.kind === kind && there.sentence === sentence);
  if (same) {
    toasts.value = toasts.value.map((there) => (there === same ? { ...there, count: there.count + 1 } : there));
    expire(same.id, kind);
    return;
  }
  lastId += 1;
  toasts.value = [...toasts.value, { id: lastId, kind, sentence, count: 1 }].slice(-MOST);
  expire(lastId, kind);
}

/** Takes a message away. */
export function dismiss(id: number): void {
  clearTimeout(timers.get(id));
  timers.delete(id);
  toasts.value = toasts.value.filter((there) => there.id !== id);
}

function expire(id: number, kind: "error" | "info"): void {
  clearTimeout(timers.get(id));
  timers.set(
    id,
    setTimeout(() => dismiss(id), STAYS[kind]),
  );
}
