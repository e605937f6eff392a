// Plots of joints over a recording, with a line at the present position.
import "uplot/dist/uPlot.min.css";
import { batch, computed, effect, signal } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect, useMemo, useRef } from "preact/hooks";
import { Icon } from "../panels/icons";
import { unitOf, type Quantity } from "../panels/quantity";
import { Chart, type Line } from "../plots/chart";
import { MAX_PLOTTED } from "../plots/plotted";
import type { Extent } from "../plots/visible";
import { topicPart } from "../recording/timeline";
import { degrees, plotsOpen } from "../state/view";
import type { Axis } from "../state/world";
import { shownTextSize } from "../style/text-size";
import { shownTheme } from "../style/theme";
import { Casting } from "./casting";
import { Overview } from "./overview";
import type { Player } from "./player";

const QUANTITIES: readonly Quantity[] = ["position", "velocity", "effort"];
/** Number of joints that are plotted before others are chosen. */
const DEFAULTS = 3;

/** The quantity that is shown on a narrow page. */
const front = signal<Quantity>("position");

/** The plots of one recording. */
class Plots {
  /** Joints in the states that have been shown. */
  readonly axes = signal<readonly Axis[]>([]);
  readonly chosen = signal<readonly Line[]>([]);
  readonly zoom = signal<Extent | null>(null);
  readonly charts = new Set<Chart>();
  private overview: Overview | undefined;
  private request = 0;
  private readonly casting: Casting;
  private readonly ends: (() => void)[];

  constructor(readonly player: Player) {
    this.casting = new Casting(player.timeline);
    this.ends = [
      effect(() => this.see()),
      effect(() => this.read(this.chosen.value)),
      effect(() => {
        void [this.zoom.value, degrees.value, this.player.position.value];
        this.redraw();
      }),
    ];
  }

  toggle(axis: Axis): void {
    const lines = this.chosen.peek();
    if (lines.some((line) => line.axis.key === axis.key)) {
      this.chosen.value = lines.filter((line) => line.axis.key !== axis.key);
      return;
    }
    const slot = Array.from({ length: MAX_PLOTTED }, (_, index) => index).find((index) => !lines.some((line) => line.slot === index));
    if (slot !== undefined) this.chosen.value = [...lines, { axis, slot }];
  }

  /** Draws with the next frame. */
  redraw(): void {
    if (this.request === 0) this.request = requestAnimationFrame(() => this.draw());
  }

  end(): void {
    for (const end of this.ends) end();
    cancelAnimationFrame(this.request);
    this.overview?.stop();
  }

  private draw(): void {
    this.request = 0;
    const { timeline, position, end } = this.player;
    const range = this.zoom.peek() ?? { min: 0, max: Math.max(timeline.period, end * timeline.period) };
    for (const chart of this.charts) {
      if (this.overview) chart.draw(this.overview, range, degrees.peek());
      chart.mark(Math.floor(position.peek()) * timeline.period);
    }
  }

  /** Adds the joints of the state that is shown. */
  private see(): void {
    const state = this.player.shown.value;
    if (!state) return;
    const known = new Set(this.axes.peek().map(({ key }) => key));
    const more: Axis[] = [];
    for (const robot of state.poses.keys()) {
      const names = state.joints.get(topicPart(robot))?.name ?? [];
      for (const joint of names) {
        const key = `${robot}/${joint}`;
        if (known.has(key)) continue;
        known.add(key);
        const kind = this.casting.description(robot)?.sliding.has(joint) ? "length" : "angle";
        more.push({ key, robot, joint, axis: 0, label: joint, kind, positionIndex: 0, velocityIndex: 0, childLink: "", actuated: false, claimedBy: "" });
      }
    }
    if (more.length === 0) return;
    const isFirst = known.size === more.length;
    batch(() => {
      this.axes.value = [...this.axes.peek(), ...more];
      if (isFirst) this.chosen.value = more.slice(0, DEFAULTS).map((axis, slot) => ({ axis, slot }));
    });
  }

  private read(lines: readonly Line[]): void {
    this.overview?.stop();
    this.overview = new Overview(this.player.timeline, lines.map(({ axis }) => axis), () => this.redraw());
    void this.overview.read();
    this.redraw();
  }
}

/** The drawer, rendered only while it is open. */
export function PlaybackPlots({ player }: { player: Player }): JSX.Element {
  const plots = useMemo(() => new Plots(player), [player]);
  useEffect(() => () => plots.end(), [plots]);
  return (
    <section class="plots" aria-label="Plots of the recording" data-testid="playback-plots-drawer">
      <header class="plots-bar">
        <Chips plots={plots} />
        <Picker plots={plots} />
        <div class="segments narrow-only" role="group" aria-label="Quantity">
          {QUANTITIES.map((quantity) => (
            <button
              key={quantity}
              type="button"
              aria-pressed={front.value === quantity}
              onClick={() => {
                front.value = quantity;
                requestAnimationFrame(() => plots.redraw());
              }}
            >
              {quantity}
            </button>
          ))}
        </div>
        <div class="plot-tools">
          <button type="button" class="button sign" aria-label="Reset the zoom" title="Show all of the recording (double click in a plot)" disabled={plots.zoom.value === null} onClick={() => (plots.zoom.value = null)}>
            <Icon name="fit" />
          </button>
          <button type="button" class="button quiet sign" aria-label="Close the plots" title="Close the plots (P)" onClick={() => (plotsOpen.value = false)}>
            <Icon name="close" />
          </button>
        </div>
      </header>
      <div class="charts" data-front={front}>
        {QUANTITIES.map((quantity) => (
          <Plot key={quantity} quantity={quantity} plots={plots} />
        ))}
      </div>
    </section>
  );
}

/** The plotted joints. */
function Chips({ plots }: { plots: Plots }): JSX.Element {
  const several = useMemo(() => computed(() => new Set(plots.axes.value.map(({ robot }) => robot)).size > 1), [plots]).value;
  return (
    <ul class="chips" aria-label="Plotted joints">
      {plots.chosen.value.map(({ axis, slot }) => (
        <li key={axis.key} class="chip" data-series={slot}>
          <span class="swatch" />
          <span class="chip-name" title={axis.key}>
            {several ? axis.key : axis.label}
          </span>
          <button type="button" aria-label={`Take ${axis.label} out of the plots`} title="Take out of the plots" onClick={() => plots.toggle(axis)}>
            <Icon name="close" />
          </button>
        </li>
      ))}
    </ul>
  );
}

/** Adds a joint. */
function Picker({ plots }: { plots: Plots }): JSX.Element | null {
  const shown = plots.chosen.value;
  const left = plots.axes.value.filter(({ key }) => !shown.some(({ axis }) => axis.key === key));
  if (left.length === 0 || shown.length >= MAX_PLOTTED) return null;
  return (
    <select
      class="picker"
      aria-label="Plot another joint"
      title="Plot another joint"
      value=""
      onChange={(event) => {
        const axis = left.find(({ key }) => key === event.currentTarget.value);
        if (axis) plots.toggle(axis);
        event.currentTarget.value = "";
      }}
    >
      <option value="">+ joint</option>
      {left.map(({ key }) => (
        <option key={key} value={key}>
          {key}
        </option>
      ))}
    </select>
  );
}

/** One plot. A click in it seeks to that time. */
function Plot({ quantity, plots }: { quantity: Quantity; plots: Plots }): JSX.Element {
  const host = useRef<HTMLDivElement>(null);
  const readout = useRef<HTMLDivElement>(null);
  const theme = shownTheme.value;
  const size = shownTextSize.value;
  const lines = plots.chosen.value;
  useEffect(() => {
    if (!host.current || !readout.current) return undefined;
    const { player } = plots;
    const chart = new Chart(host.current, readout.current, quantity, lines, (range) => {
      plots.zoom.value = range;
    });
    chart.onPick((time) => {
      player.playing.value = false;
      player.seek(Math.round(time / player.timeline.period));
    });
    plots.charts.add(chart);
    plots.redraw();
    return () => {
      plots.charts.delete(chart);
      chart.destroy();
    };
  }, [lines, theme, size, quantity, plots]);
  const units = [...new Set(lines.map(({ axis }) => unitOf(axis.kind, quantity, degrees.value).name))];
  return (
    <figure class="plot" data-testid={`playback-plot-${quantity}`} data-quantity={quantity} aria-label={`Plot of ${quantity}`}>
      <figcaption>
        {quantity} <span class="hint">{units.join(", ")}</span>
      </figcaption>
      <div class="plot-host" ref={host} />
      <div class="plot-readout" ref={readout} hidden />
    </figure>
  );
}
