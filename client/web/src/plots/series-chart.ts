// One plot of series of one unit over time, on uPlot, with a line for each event.
import type uPlot from "uplot";
import { happenings } from "../state/happenings";
import { lines } from "./lines";
import type { Samples } from "./samples";
import { TimePlot, type ReadoutRow } from "./time-plot";
import { indicesBetween, valueExtent, type Extent } from "./visible";

/** A line of the plot. */
export interface SeriesLine {
  key: string;
  label: string;
  /** Number of its colour, 0 to 7. */
  slot: number;
}

/** The minimum range of the value axis, so that rounding does not fill the plot. */
const MIN_RANGE = 1e-3;

/** A plot in an element of the page. */
export class SeriesChart {
  private readonly time: TimePlot;

  constructor(
    private readonly host: HTMLElement,
    readout: HTMLElement,
    private readonly series: readonly SeriesLine[],
    private readonly unit: string,
    onZoom: (range: Extent | null) => void,
  ) {
    const warning = getComputedStyle(host).getPropertyValue("--warning").trim();
    this.time = new TimePlot(host, readout, {
      series: (colour) => series.map(({ slot }) => ({ stroke: colour(`--series-${slot + 1}`), width: 1.5, paths: lines, points: { show: false } })),
      onZoom,
      readout: (plot, at, time) => this.rows(plot, at, time),
      onDraw: (plot, stroke) => drawEvents(plot, stroke, warning),
    });
  }

  destroy(): void {
    this.time.destroy();
  }

  /** Draws a range of a recording. */
  draw(samples: Samples, range: Extent): void {
    if (this.host.clientWidth === 0) return;
    const { from, to } = indicesBetween(samples.times(), range);
    const columns = this.series.map(({ key }) => {
      const column = samples.column(key).slice(from, to);
      return column.length === to - from ? column : new Float64Array(to - from).fill(NaN);
    });
    const { plot } = this.time;
    plot.batch(() => {
      plot.setData([samples.times().slice(from, to), ...columns], false);
      plot.setScale("x", range);
      plot.setScale("y", valueExtent(columns, MIN_RANGE));
    });
  }

  /** The values at the pointer, and the event that is nearest to it. */
  private rows(plot: uPlot, at: number, time: number): (ReadoutRow | string)[] {
    const rows = this.series.map(({ label, slot }, index) => {
      const value = plot.data[index + 1]?.[at];
      return { slot, text: `${label} ${value === null || value === undefined || Number.isNaN(value) ? "–" : String(Number(value.toPrecision(5)))} ${this.unit}` };
    });
    const near = plot.posToVal(4, "x") - plot.posToVal(0, "x");
    const event = happenings.peek().find(({ simTime }) => Math.abs(simTime - time) <= near);
    return event ? [...rows, event.text] : rows;
  }
}

/** A dashed line at the time of each event that is in view. */
function drawEvents(plot: uPlot, usual: string, warning: string): void {
  const { ctx, bbox } = plot;
  const { min, max } = plot.scales["x"] ?? {};
  ctx.save();
  ctx.setLineDash([3, 4]);
  ctx.lineWidth = devicePixelRatio;
  for (const { simTime, isWarning } of happenings.peek()) {
    if (min === undefined || max === undefined || simTime < min || simTime > max) continue;
    const x = Math.round(plot.valToPos(simTime, "x", true)) + 0.5;
    ctx.strokeStyle = isWarning ? warning : usual;
    ctx.beginPath();
    ctx.moveTo(x, bbox.top);
    ctx.lineTo(x, bbox.top + bbox.height);
    ctx.stroke();
  }
  ctx.restore();
}
