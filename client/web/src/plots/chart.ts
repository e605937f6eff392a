// One plot of one quantity over time, on uPlot.
import type uPlot from "uplot";
import { digits, quantityOf, unitOf, type Quantity } from "../panels/quantity";
import type { Axis } from "../state/world";
import { lines } from "./lines";
import { columnOf, MODES } from "./recorder";
import type { Samples } from "./samples";
import { TimePlot, type ReadoutRow } from "./time-plot";
import { indicesBetween, valueExtent, type Extent } from "./visible";

/** Columns over an increasing time. */
export type Columns = Pick<Samples, "times" | "column">;

/** An axis and the colour that it has in all plots. */
export interface Line {
  axis: Axis;
  /** 0 to 7. */
  slot: number;
}

/** The minimum range of the value axis, in the shown unit, so that noise does not fill the plot. */
const MIN_RANGE = { position: 0.02, velocity: 0.02, effort: 0.2 } as const;

/** A plot in an element of the page. */
export class Chart {
  private readonly time: TimePlot;
  private readonly plot: uPlot;
  /** The plotted data, reused by each draw: the time, then value and target of each line. */
  private buffers: Float64Array[] = [];
  private degrees = false;
  private marker: HTMLElement | undefined;

  constructor(
    private readonly host: HTMLElement,
    readout: HTMLElement,
    private readonly quantity: Quantity,
    private readonly shown: readonly Line[],
    onZoom: (range: Extent | null) => void,
  ) {
    this.time = new TimePlot(host, readout, {
      series: (colour) =>
        shown.flatMap(({ slot }) => {
          const stroke = colour(`--series-${slot + 1}`);
          return [
            { stroke, width: 1.5, paths: lines, points: { show: false } },
            { stroke, width: 1.25, dash: [5, 4], alpha: 0.75, paths: lines, points: { show: false } },
          ];
        }),
      onZoom,
      readout: (plot, at) => this.rows(plot, at),
    });
    this.plot = this.time.plot;
  }

  destroy(): void {
    this.time.destroy();
  }

  /** Draws a range of a recording. */
  draw(samples: Columns, range: Extent, degrees: boolean): void {
    // Hidden plots are not drawn.
    if (this.host.clientWidth === 0) return;
    this.degrees = degrees;
    const { from, to } = indicesBetween(samples.times(), range);
    const count = to - from;
    const time = this.buffer(0, count);
    time.set(samples.times().subarray(from, to));
    const drawn: Float64Array[] = [];
    this.shown.forEach(({ axis }, index) => {
      const { scale } = unitOf(axis.kind, this.quantity, degrees);
      const part = (name: "target" | "mode" | Quantity): Float64Array => samples.column(columnOf(axis.key, name)).subarray(from, to);
      const [values, targets, modes] = [part(this.quantity), part("target"), part("mode")];
      const line = this.buffer(2 * index + 1, count).fill(NaN);
      const dashed = this.buffer(2 * index + 2, count).fill(NaN);
      for (let at = 0; at < values.length; at += 1) {
        line[at] = (values[at] ?? NaN) / scale;
        const mode = MODES[modes[at] ?? 0] ?? "none";
        const driven = mode !== "none" && mode !== "passive" && quantityOf(mode) === this.quantity;
        if (driven) dashed[at] = (targets[at] ?? NaN) / scale;
      }
      drawn.push(line, dashed);
    });
    const { plot } = this;
    plot.batch(() => {
      plot.setData([time, ...drawn], false);
      plot.setScale("x", range);
      plot.setScale("y", valueExtent(drawn, MIN_RANGE[this.quantity]));
    });
  }

  /** Draws a line across the plot at a time. */
  mark(time: number): void {
    if (!this.marker) {
      this.marker = document.createElement("div");
      this.marker.className = "plot-marker";
      this.plot.over.append(this.marker);
    }
    const { min = 0, max = 0 } = this.plot.scales["x"] ?? {};
    this.marker.hidden = time < (min ?? 0) || time > (max ?? 0);
    this.marker.style.left = `${this.plot.valToPos(time, "x")}px`;
  }

  /** Calls back with the time of a click in the plot; a drag is not a click. */
  onPick(pick: (time: number) => void): void {
    let pressedAt = 0;
    this.plot.over.addEventListener("mousedown", (event) => {
      pressedAt = event.clientX;
    });
    this.plot.over.addEventListener("click", (event) => {
      const at = this.plot.cursor.left ?? -1;
      if (at >= 0 && Math.abs(event.clientX - pressedAt) < 4) pick(this.plot.posToVal(at, "x"));
    });
  }

  /** Returns an array of this length, a view of the last draw's array if that is long enough. */
  private buffer(index: number, count: number): Float64Array {
    let kept = this.buffers[index];
    if (!kept || kept.length < count) {
      kept = new Float64Array(Math.max(1024, 2 * count));
      this.buffers[index] = kept;
    }
    return kept.subarray(0, count);
  }

  /** The values of the lines at the pointer, each with its target. */
  private rows(plot: uPlot, at: number): ReadoutRow[] {
    return this.shown.map(({ axis, slot }, index) => {
      const unit = unitOf(axis.kind, this.quantity, this.degrees);
      const text = (line: number): string => {
        const value = plot.data[line]?.[at];
        return value === undefined || value === null || Number.isNaN(value) ? "" : digits(value * unit.scale, unit);
      };
      const target = text(2 * index + 2);
      return { slot, text: `${text(2 * index + 1)}${target === "" ? "" : ` → ${target}`} ${unit.name}` };
    });
  }
}
