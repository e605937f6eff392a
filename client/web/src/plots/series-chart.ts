// One plot of series of one unit over time, on uPlot, with a line for each event.
import uPlot from "uplot";
import { happenings } from "../state/happenings";
import { lines } from "./lines";
import type { Samples } from "./samples";
import { indicesBetween, valueExtent, type Extent } from "./visible";

/** A line of the plot. */
export interface SeriesLine {
  key: string;
  label: string;
  /** Of its colour, 0 to 7. */
  slot: number;
}

/** The minimum range of the value axis, so that rounding does not fill the plot. */
const MIN_RANGE = 1e-3;

/** A plot in an element of the page. */
export class SeriesChart {
  private readonly plot: uPlot;
  private readonly resizing: ResizeObserver;

  constructor(
    private readonly host: HTMLElement,
    private readonly readout: HTMLElement,
    private readonly series: readonly SeriesLine[],
    private readonly unit: string,
    onZoom: (range: Extent | null) => void,
  ) {
    const style = getComputedStyle(host);
    const colour = (name: string): string => style.getPropertyValue(name).trim();
    const zoom = (parseFloat(getComputedStyle(document.documentElement).fontSize) || 16) / 16;
    const axis = { stroke: colour("--text-2"), font: `${Math.round(11 * zoom)}px system-ui, sans-serif`, grid: { stroke: colour("--line"), width: 1 }, ticks: { stroke: colour("--line"), width: 1, size: 4 } };
    const warning = colour("--warning");
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
            if (width < 4 || host.clientWidth === 0) return;
            onZoom({ min: plot.posToVal(left, "x"), max: plot.posToVal(left + width, "x") });
            plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
          },
        ],
        setCursor: [() => this.updateReadout()],
        draw: [(plot) => drawEvents(plot, axis.stroke, warning)],
      },
      series: [{}, ...series.map(({ slot }) => ({ stroke: colour(`--series-${slot + 1}`), width: 1.5, paths: lines, points: { show: false } }))],
    };
    this.plot = new uPlot(options, [[], ...series.map(() => [])], host);
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
  draw(samples: Samples, range: Extent): void {
    if (this.host.clientWidth === 0) return;
    const { from, to } = indicesBetween(samples.times(), range);
    const columns = this.series.map(({ key }) => {
      const column = samples.column(key).slice(from, to);
      return column.length === to - from ? column : new Float64Array(to - from).fill(NaN);
    });
    const { plot } = this;
    plot.batch(() => {
      plot.setData([samples.times().slice(from, to), ...columns], false);
      plot.setScale("x", range);
      plot.setScale("y", valueExtent(columns, MIN_RANGE));
    });
  }

  /** Shows the values at the pointer, and the event that is nearest to it. */
  private updateReadout(): void {
    const { plot } = this;
    const at = plot.cursor.idx;
    const time = at === null || at === undefined ? undefined : plot.data[0][at];
    this.readout.hidden = time === undefined || (plot.cursor.left ?? -1) < 0;
    if (this.readout.hidden || time === undefined || at === null || at === undefined) return;
    const rows = this.series.map(({ label, slot }, index) => {
      const value = plot.data[index + 1]?.[at];
      const row = document.createElement("div");
      row.dataset["series"] = String(slot);
      row.textContent = `${label} ${value === null || value === undefined || Number.isNaN(value) ? "–" : String(Number(value.toPrecision(5)))} ${this.unit}`;
      return row;
    });
    const head = document.createElement("div");
    head.textContent = `${time.toFixed(3)} s`;
    const near = plot.posToVal(4, "x") - plot.posToVal(0, "x");
    const event = happenings.peek().find(({ simTime }) => Math.abs(simTime - time) <= near);
    const said = document.createElement("div");
    said.textContent = event?.text ?? "";
    this.readout.replaceChildren(head, ...rows, ...(event ? [said] : []));
    this.readout.toggleAttribute("data-right", (plot.cursor.left ?? 0) < plot.bbox.width / devicePixelRatio / 2);
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
