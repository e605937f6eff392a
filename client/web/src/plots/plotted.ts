// Plotted joints, with their colours.
import { computed } from "@preact/signals";
import { plotsOpen, plottedSlots } from "../state/view";
import { robots, type Axis } from "../state/world";

/** The number of colours, and of joints that can be plotted at once. */
export const MAX_PLOTTED = 8;

/** Colour slots, 0 to 7, by axis key, in the order in which axes were added. */
export const plotted = computed<ReadonlyMap<string, number>>(() => new Map(plottedSlots.value));

/** The colour slot of an axis; undefined if it is not plotted. */
export function colorSlotOf(key: string): number | undefined {
  return plotted.value.get(key);
}

/** Adds an axis to the plots, in place of the oldest if all colours are in use. */
export function addPlot(key: string): void {
  if (plotted.peek().has(key)) return;
  const next = new Map(plotted.peek());
  if (next.size >= MAX_PLOTTED) {
    const [oldest] = next.keys();
    if (oldest !== undefined) next.delete(oldest);
  }
  const taken = new Set(next.values());
  const slot = Array.from({ length: MAX_PLOTTED }, (_, index) => index).find((index) => !taken.has(index)) ?? 0;
  plottedSlots.value = [...next.set(key, slot)];
}

export function removePlot(key: string): void {
  const next = new Map(plotted.peek());
  if (next.delete(key)) plottedSlots.value = [...next];
}

/** Adds an axis and opens the plots, or removes it. */
export function togglePlot(axis: Axis): void {
  if (plotted.peek().has(axis.key)) {
    removePlot(axis.key);
  } else {
    addPlot(axis.key);
    plotsOpen.value = true;
  }
}

/** The axis of a key, if it exists. */
export function axisOf(key: string): Axis | undefined {
  for (const robot of robots.value) {
    const axis = robot.axes.find((one) => one.key === key);
    if (axis) return axis;
  }
  return undefined;
}
