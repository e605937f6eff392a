// The range of a recording that a plot shows, and the limits of its axes.

/** Limits of an axis. */
export interface Extent {
  min: number;
  max: number;
}

/** Index of the first time that is not before `time`. */
export function firstAt(times: ArrayLike<number>, time: number): number {
  let low = 0;
  let high = times.length;
  while (low < high) {
    const middle = (low + high) >>> 1;
    if ((times[middle] ?? Infinity) < time) low = middle + 1;
    else high = middle;
  }
  return low;
}

/** The samples between two times, and one more on each side, so that lines reach the edges. */
export function indicesBetween(times: ArrayLike<number>, { min, max }: Extent): { from: number; to: number } {
  return { from: Math.max(0, firstAt(times, min) - 1), to: Math.min(times.length, firstAt(times, max) + 1) };
}

/** Returns the last `span` seconds; while the recording is shorter, the plot fills from the left. */
export function following(times: ArrayLike<number>, span: number): Extent {
  const first = times[0] ?? 0;
  const last = times[times.length - 1] ?? 0;
  return last - first < span ? { min: first, max: first + span } : { min: last - span, max: last };
}

/** Limits of the value axis: all values with a margin, and a range of at least `least`. */
export function valueExtent(series: readonly Float64Array[], least: number): Extent {
  let min = Infinity;
  let max = -Infinity;
  for (const values of series) {
    for (const value of values) {
      if (value < min) min = value;
      if (value > max) max = value;
    }
  }
  if (min > max) return { min: -least / 2, max: least / 2 };
  const margin = Math.max((max - min) * 0.08, (least - (max - min)) / 2);
  return { min: min - margin, max: max + margin };
}
