// Which joints are plotted, and in which colour.
import { signal } from "@preact/signals";
import { plotsOpen } from "../state/view";
import { robots, type Axis } from "../state/world";

/** How many colours can be told apart; no more joints than that are plotted at once. */
export const MOST_PLOTTED = 8;

/** Colour slots, 0 to 7, by axis key, in the order of choosing. */
export const chosen = signal<ReadonlyMap<string, number>>(new Map());

/** The colour slot of an axis, or nothing where it is not plotted. */
export function colourOf(key: string): number | undefined {
  return chosen.value.get(key);
}

/** Puts an axis into the plots, in the place of the oldest where all colours are taken. */
export function addPlot(key: string): void {
  if (chosen.peek().has(key)) return;
  const next = new Map(chosen.peek());
  if (next.size >= MOST_PLOTTED) {
    const [oldest] = next.keys();
    if (oldest !== undefined) next.delete(oldest);
  }
  const taken = new Set(next.values());
  const slot = Array.from({ length: MOST_PLOTTED }, (_, index) => index).find((index) => !taken.has(index)) ?? 0;
  chosen.value = next.set(key, slot);
}

export function removePlot(key: string): void {
  const next = new Map(chosen.peek());
  if (next.delete(key)) chosen.value = next;
}

/** Adds an axis and shows the plots, or takes it out. */
export function togglePlot(axis: Axis): void {
  if (chosen.peek().has(axis.key)) {
    removePlot(axis.key);
  } else {
    addPlot(axis.key);
    plotsOpen.value = true;
  }
}

/** The axis of a key, where it is still there. */
export function axisOf(key: string): Axis | undefined {
  for (const robot of robots.value) {
    const axis = robot.axes.find((one) => one.key === key);
    if (axis) return axis;
  }
  return undefined;
}
