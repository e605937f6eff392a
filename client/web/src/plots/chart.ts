// One plot of one quantity over time, on uPlot.
import uPlot from "uplot";
import { digits, quantityOf, unitOf, type Quantity } from "../panels/quantity";
import type { Axis } from "../state/world";
import { lines } from "./lines";
import { columnOf, MODES } from "./recorder";
import type { Samples } from "./samples";
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
  private readonly plot: uPlot;
  private readonly resizing: ResizeObserver;
  /** The plotted data, reused by each draw: the time, then value and target of each line. */
  private buffers: Float64Array[] = [];
  private degrees = false;
  private marker: HTMLElement | undefined;

  constructor(
    private readonly host: HTMLElement,
    private readonly readout: HTMLElement,
    private readonly quantity: Quantity,
    private readonly shown: readonly Line[],
    onZoom: (range: Extent | null) => void,
  ) {
    const style = getComputedStyle(host);
    const colour = (name: string): string => style.getPropertyValue(name).trim();
    /** How much larger text is than usual. */
    const zoom = (parseFloat(getComputedStyle(document.documentElement).fontSize) || 16) / 16;
    const font = `${Math.round(11 * zoom)}px system-ui, sans-serif`;
    const axis = { stroke: colour("--text-2"), font, grid: { stroke: colour("--line"), width: 1 }, ticks: { stroke: colour("--line"), width: 1, size: 4 } };
    const options: uPlot.Options = {
      width: Math.max(80, host.clientWidth),
      height: Math.max(60, host.clientHeight),
      padding: [6, 14, 0, 0],
      legend: { show: false },
      scales: { x: { time: false, auto: false }, y: { auto: false } },
      axes: [
        { ...axis, size: 26 * zoom, space: 64 * zoom, values: (_, ticks) => ticks.map((tick) => String(Number(tick.toFixed(6)))) },
        { ...axis, size: 52 * zoom, space: 32 * zoom, values: (_, ticks) => ticks.map((tick) => String(Number(tick.toPrecision(6)))) },
      ],
      cursor: {
        points: { show: false },
        y: false,
        drag: { x: true, y: false, setScale: false },
        sync: { key: "simd" },
        bind: {
          dblclick: () => () => {
            onZoom(null);
            return null;
          },
        },
      },
      hooks: {
        setSelect: [
          (plot) => {
            const { left, width } = plot.select;
            // A click is no zoom. Each drag reaches the other plots too; those that are hidden have no scale.
            if (width < 4 || host.clientWidth === 0) return;
            onZoom({ min: plot.posToVal(left, "x"), max: plot.posToVal(left + width, "x") });
            plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
          },
        ],
        setCursor: [(plot) => this.updateReadout(plot)],
      },
      series: [
        {},
        ...shown.flatMap(({ slot }) => {
          const stroke = colour(`--series-${slot + 1}`);
          return [
            { stroke, width: 1.5, paths: lines, points: { show: false } },
            { stroke, width: 1.25, dash: [5, 4], alpha: 0.75, paths: lines, points: { show: false } },
          ];
        }),
      ],
    };
    this.plot = new uPlot(options, [[], ...shown.flatMap(() => [[], []])], host);
    this.resizing = new ResizeObserver(() => {
      if (host.clientWidth > 0 && host.clientHeight > 0) this.plot.setSize({ width: host.clientWidth, height: host.clientHeight });
    });
    this.resizing.observe(host);
  }

  destroy(): void {
    this.resizing.disconnect();
    this.plot.destroy();
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

  /** Calls with the time at which the plot is clicked, which is no drag. */
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

  /** An array of this length, a view of the one of the last draw if that is long enough. */
  private buffer(index: number, count: number): Float64Array {
    let kept = this.buffers[index];
    if (!kept || kept.length < count) {
      kept = new Float64Array(Math.max(1024, 2 * count));
      this.buffers[index] = kept;
    }
    return kept.subarray(0, count);
  }

  /** Shows the values of the lines at the pointer. */
  private updateReadout(plot: uPlot): void {
    const at = plot.cursor.idx;
    const time = at === null || at === undefined ? undefined : plot.data[0][at];
    this.readout.hidden = time === undefined || (plot.cursor.left ?? -1) < 0;
    if (this.readout.hidden || time === undefined || at === null || at === undefined) return;
    const rows = this.shown.map(({ axis, slot }, index) => {
      const unit = unitOf(axis.kind, this.quantity, this.degrees);
      const row = document.createElement("div");
      row.dataset["series"] = String(slot);
      const text = (line: number): string => {
        const value = plot.data[line]?.[at];
        return value === undefined || value === null || Number.isNaN(value) ? "" : digits(value * unit.scale, unit);
      };
      const target = text(2 * index + 2);
      row.textContent = `${text(2 * index + 1)}${target === "" ? "" : ` → ${target}`} ${unit.name}`;
      return row;
    });
    const head = document.createElement("div");
    head.textContent = `${time.toFixed(3)} s`;
    this.readout.replaceChildren(head, ...rows);
    // On the other side than the pointer.
    this.readout.toggleAttribute("data-right", (plot.cursor.left ?? 0) < plot.bbox.width / devicePixelRatio / 2);
  }
}
