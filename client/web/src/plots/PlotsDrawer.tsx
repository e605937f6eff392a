// The drawer with the plots: position, velocity and effort of the plotted joints, with their targets.
import "uplot/dist/uPlot.min.css";
import { computed, effect, signal } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { Icon } from "../panels/icons";
import { unitOf, type Quantity } from "../panels/quantity";
import { shownRobot } from "../panels/shown-robot";
import { shownTheme } from "../style/theme";
import { shownTextSize } from "../style/text-size";
import { save } from "../state/download";
import { degrees, plotSpan, plotsOpen } from "../state/view";
import { daemonName, frame, robots } from "../state/world";
import { Chart, type Line } from "./chart";
import { addPlot, axisOf, plotted, MAX_PLOTTED, removePlot } from "./plotted";
import { asCsv } from "./export";
import { recording, SPAN } from "./recorder";
import type { Samples } from "./samples";
import { seriesRecording, SERIES_SPAN } from "./series-recorder";
import { drawSeries, hasSeries, SeriesPicker, SeriesPlots } from "./SeriesPlots";
import { following, type Extent } from "./visible";

const QUANTITIES: readonly Quantity[] = ["position", "velocity", "effort"];
/** Minimum milliseconds between two draws. */
const INTERVAL = 50;

/** Selectable spans, simulated seconds. */
const SPANS: readonly number[] = [2, 5, 10, 30, SPAN, 180, SERIES_SPAN];
const span = computed(() => (SPANS.includes(plotSpan.value) ? plotSpan.value : 10));
const zoom = signal<Extent | null>(null);
/** Copy that is shown while the plots are paused; the recorder continues. */
const paused = signal<Samples | null>(null);
/** Copy of the series other than joints, shown while the plots are paused. */
const pausedSeries = signal<Samples | null>(null);
/** The quantity that is shown on a narrow page. */
const front = signal<Quantity>("position");

/** Plotted axes whose robots exist. */
const shown = computed<Line[]>(() =>
  [...plotted.value].flatMap(([key, slot]) => {
    const axis = axisOf(key);
    return axis ? [{ axis, slot }] : [];
  }),
);

const charts = new Set<Chart>();
let drawn = 0;
let waiting: number | undefined;

function draw(): void {
  waiting = undefined;
  drawn = performance.now();
  const samples = paused.peek() ?? recording;
  const range = zoom.peek() ?? following(samples.times(), span.peek());
  for (const chart of charts) chart.draw(samples, range, degrees.peek());
  drawSeries((times) => zoom.peek() ?? following(times, span.peek()), pausedSeries.peek() ?? undefined);
}

/** Schedules a draw. */
function scheduleDraw(): void {
  if (waiting !== undefined) return;
  waiting = setTimeout(() => requestAnimationFrame(draw), Math.max(0, INTERVAL - (performance.now() - drawn))) as unknown as number;
}

/**
 * Plots the first joints of the shown robot if none are plotted. It runs once, as soon as the robot has
 * joints.
 */
function plotDefaults(): () => void {
  let done = shown.peek().length > 0;
  return effect(() => {
    const axes = shownRobot.value?.axes ?? [];
    if (done || axes.length === 0) return;
    done = true;
    for (const { key } of axes.slice(0, 3)) addPlot(key);
  });
}

/** The drawer, rendered only while it is open. */
export function PlotsDrawer(): JSX.Element {
  useEffect(plotDefaults, []);
  useEffect(() => {
    return effect(() => {
      void [zoom.value, span.value, paused.value, degrees.value];
      // Paused plots do not follow new states.
      if (paused.value === null) void frame.value;
      scheduleDraw();
    });
  }, []);
  return (
    <section class="plots" aria-label="Plots" data-testid="plots">
      <header class="plots-bar">
        <Chips />
        <Picker />
        <SeriesPicker />
        <div class="segments narrow-only" role="group" aria-label="Quantity">
          {QUANTITIES.map((quantity) => (
            <button
              key={quantity}
              type="button"
              aria-pressed={front.value === quantity}
              onClick={() => {
                front.value = quantity;
                requestAnimationFrame(scheduleDraw);
              }}
            >
              {quantity}
            </button>
          ))}
        </div>
        <Tools />
      </header>
      {(shown.value.length > 0 || !hasSeries.value) && (
        <div class="charts" data-front={front}>
          {QUANTITIES.map((quantity) => (
            <Plot key={quantity} quantity={quantity} />
          ))}
        </div>
      )}
      <SeriesPlots onZoom={(range) => (zoom.value = range)} redraw={scheduleDraw} />
    </section>
  );
}

/** The plotted joints, with their colours. */
function Chips(): JSX.Element {
  const several = robots.value.length > 1;
  return (
    <ul class="chips" aria-label="Plotted joints">
      {shown.value.map(({ axis, slot }) => (
        <li key={axis.key} class="chip" data-series={slot}>
          <span class="swatch" />
          <span class="chip-name" title={axis.key}>
            {several ? `${axis.robot}/${axis.label}` : axis.label}
          </span>
          <button type="button" aria-label={`Take ${axis.label} out of the plots`} title="Take out of the plots" onClick={() => removePlot(axis.key)}>
            <Icon name="close" />
          </button>
        </li>
      ))}
    </ul>
  );
}

/** Adds a joint. */
function Picker(): JSX.Element | null {
  const left = robots.value.map((robot) => ({ robot, axes: robot.axes.filter(({ key }) => !plotted.value.has(key)) })).filter(({ axes }) => axes.length > 0);
  if (left.length === 0 || shown.value.length >= MAX_PLOTTED) return null;
  return (
    <select
      class="picker"
      data-testid="plot-picker"
      aria-label="Plot another joint"
      title="Plot another joint"
      value=""
      onChange={(event) => {
        addPlot(event.currentTarget.value);
        event.currentTarget.value = "";
      }}
    >
      <option value="">+ joint</option>
      {left.map(({ robot, axes }) => (
        <optgroup key={robot.name} label={robot.name}>
          {axes.map(({ key, label }) => (
            <option key={key} value={key}>
              {label}
            </option>
          ))}
        </optgroup>
      ))}
    </select>
  );
}

/** Buttons for zoom, span, pause and export. */
function Tools(): JSX.Element {
  const isPaused = paused.value !== null;
  const togglePause = (): void => {
    paused.value = isPaused ? null : recording.copy();
    pausedSeries.value = isPaused ? null : seriesRecording.copy();
    if (isPaused) zoom.value = null;
  };
  const exportAll = (): void => {
    const axes = shown.peek().map(({ axis }) => axis);
    save(`${daemonName.peek() || "simd"}-joints.csv`, new Blob([asCsv(paused.peek() ?? recording, axes)], { type: "text/csv" }));
  };
  return (
    <div class="plot-tools">
      <button
        type="button"
        class="button sign"
        data-testid="zoom-out"
        aria-label="Reset the zoom"
        title={zoom.value ? "Show the newest samples again (double click in a plot)" : "Drag in a plot to zoom in"}
        disabled={zoom.value === null}
        onClick={() => {
          zoom.value = null;
        }}
      >
        <Icon name="fit" />
      </button>
      <select
        aria-label="How much time the plots show"
        title="How much time the plots show"
        data-testid="plot-span"
        value={String(span.value)}
        onChange={(event) => {
          plotSpan.value = Number(event.currentTarget.value);
          zoom.value = null;
        }}
      >
        {SPANS.map((seconds) => (
          <option key={seconds} value={String(seconds)}>
            {seconds} s
          </option>
        ))}
      </select>
      <button
        type="button"
        class="button sign"
        data-testid="plot-pause"
        aria-pressed={isPaused}
        aria-label={isPaused ? "Go on" : "Pause the plots"}
        title={isPaused ? "Go on" : "Pause the plots; drag in one to zoom, double click to come back"}
        onClick={togglePause}
      >
        <Icon name={isPaused ? "play" : "pause"} />
      </button>
      <button
        type="button"
        class="button"
        data-testid="csv"
        title={`Save what was recorded, at most the last ${SPAN} s, as comma-separated values`}
        disabled={shown.value.length === 0}
        onClick={exportAll}
      >
        <Icon name="download" /> CSV
      </button>
      <button
        type="button"
        class="button quiet sign"
        aria-label="Close the plots"
        title="Close the plots (P)"
        onClick={() => {
          plotsOpen.value = false;
        }}
      >
        <Icon name="close" />
      </button>
    </div>
  );
}

/** One plot. */
function Plot({ quantity }: { quantity: Quantity }): JSX.Element {
  const host = useRef<HTMLDivElement>(null);
  const readout = useRef<HTMLDivElement>(null);
  const theme = shownTheme.value;
  const size = shownTextSize.value;
  const current = shown.value;
  useEffect(() => {
    if (!host.current || !readout.current) return undefined;
    const chart = new Chart(host.current, readout.current, quantity, current, (range) => {
      zoom.value = range;
    });
    charts.add(chart);
    scheduleDraw();
    return () => {
      charts.delete(chart);
      chart.destroy();
    };
  }, [current, theme, size, quantity]);
  const units = [...new Set(current.map(({ axis }) => unitOf(axis.kind, quantity, degrees.value).name))];
  return (
    <figure class="plot" data-testid="plot" data-quantity={quantity}>
      <figcaption>
        {quantity} <span class="hint">{units.join(", ")}</span>
      </figcaption>
      <div ref={host} class="plot-host" data-testid={`plot-${quantity}`} />
      <div ref={readout} class="plot-readout" hidden />
      {current.length === 0 && <p class="plot-empty">Press + on a joint to plot it.</p>}
    </figure>
  );
}
