// Builds the path of a line through samples: at most four points for each pixel column, with gaps at NaN.
import uPlot from "uplot";

/** A path builder of uPlot for `Float64Array`s with NaN for absent values. */
export const lines: uPlot.Series.PathBuilder = (plot, seriesIndex, from, to) => {
  const times = plot.data[0];
  const values = plot.data[seriesIndex];
  const scale = plot.series[seriesIndex]?.scale ?? "y";
  const stroke = new Path2D();
  if (!values) return { stroke, fill: null, clip: null, band: null, gaps: [], flags: 0 };
  let column = NaN;
  let low = 0;
  let high = 0;
  let last = 0;
  let pen = false;
  /** Ends a pixel column: its minimum and maximum, then its last value. */
  const flush = (): void => {
    if (low !== high) {
      stroke.lineTo(column, low);
      stroke.lineTo(column, high);
    }
    stroke.lineTo(column, last);
  };
  for (let at = from; at <= to; at += 1) {
    const value = values[at];
    const time = times[at];
    if (time === undefined || value === undefined || value === null || Number.isNaN(value)) {
      if (pen) flush();
      pen = false;
      continue;
    }
    const x = Math.round(plot.valToPos(time, "x", true));
    const y = plot.valToPos(value, scale, true);
    if (!pen) {
      stroke.moveTo(x, y);
      pen = true;
    } else if (x === column) {
      low = Math.min(low, y);
      high = Math.max(high, y);
      last = y;
      continue;
    } else {
      flush();
      stroke.lineTo(x, y);
    }
    column = x;
    low = high = last = y;
  }
  if (pen) flush();
  return { stroke, fill: null, clip: null, band: null, gaps: [], flags: 0 };
};
