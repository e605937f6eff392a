// Parts of every plot over time: axes, a zoom by dragging, a readout at the pointer, and the size of its element.
import uPlot from "uplot";
import type { Extent } from "./visible";

/** A row of the readout: its text, and the slot of its colour. */
export interface ReadoutRow {
  slot: number;
  text: string;
}

/** Differences between plots. */
export interface TimePlotOptions {
  /** The lines after the time. */
  series: (colour: (name: string) => string) => uPlot.Series[];
  /** Called with the range of a drag, and with null after a double click. */
  onZoom: (range: Extent | null) => void;
  /** The rows of the readout for the samples at this index, whose time is `time`. */
  readout: (plot: uPlot, at: number, time: number) => (ReadoutRow | string)[];
  /** Draws upon the plot. `stroke` is the colour of its axes. */
  onDraw?: (plot: uPlot, stroke: string) => void;
}

/** A plot in an element of the page, which takes its size. `readoutHost` shows the values at the pointer. */
export class TimePlot {
  readonly plot: uPlot;
  private readonly resizing: ResizeObserver;

  constructor(
    host: HTMLElement,
    private readonly readoutHost: HTMLElement,
    private readonly options: TimePlotOptions,
  ) {
    const style = getComputedStyle(host);
    const colour = (name: string): string => style.getPropertyValue(name).trim();
    /** Ratio of the text size to the default. */
    const zoom = (parseFloat(getComputedStyle(document.documentElement).fontSize) || 16) / 16;
    const font = `${Math.round(11 * zoom)}px system-ui, sans-serif`;
    const axis = { stroke: colour("--text-2"), font, grid: { stroke: colour("--line"), width: 1 }, ticks: { stroke: colour("--line"), width: 1, size: 4 } };
    const series = options.series(colour);
    const { onZoom, onDraw } = options;
    const whole: uPlot.Options = {
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
            // A click is not a zoom. Each drag reaches the other plots too; hidden ones have no scale.
            if (width < 4 || host.clientWidth === 0) return;
            onZoom({ min: plot.posToVal(left, "x"), max: plot.posToVal(left + width, "x") });
            plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
          },
        ],
        setCursor: [(plot) => this.updateReadout(plot)],
        ...(onDraw && { draw: [(plot: uPlot) => onDraw(plot, axis.stroke)] }),
      },
      series: [{}, ...series],
    };
    this.plot = new uPlot(whole, [[], ...series.map(() => [])], host);
    this.resizing = new ResizeObserver(() => {
      if (host.clientWidth > 0 && host.clientHeight > 0) this.plot.setSize({ width: host.clientWidth, height: host.clientHeight });
    });
    this.resizing.observe(host);
  }

  destroy(): void {
    this.resizing.disconnect();
    this.plot.destroy();
  }

  /** Shows the values at the pointer. */
  private updateReadout(plot: uPlot): void {
    const host = this.readoutHost;
    const at = plot.cursor.idx;
    const time = at === null || at === undefined ? undefined : plot.data[0][at];
    host.hidden = time === undefined || (plot.cursor.left ?? -1) < 0;
    if (host.hidden || time === undefined || at === null || at === undefined) return;
    const rows = [`${time.toFixed(3)} s`, ...this.options.readout(plot, at, time)].map((row) => {
      const element = document.createElement("div");
      if (typeof row !== "string") element.dataset["series"] = String(row.slot);
      element.textContent = typeof row === "string" ? row : row.text;
      return element;
    });
    host.replaceChildren(...rows);
    // Placed on the side away from the pointer.
    host.toggleAttribute("data-right", (plot.cursor.left ?? 0) < plot.bbox.width / devicePixelRatio / 2);
  }
}
