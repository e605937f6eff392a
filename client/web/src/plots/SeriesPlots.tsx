// Plots of any series: one for each unit, with a mark for each event, and the values at the pointer.
import { computed } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { Icon } from "../panels/icons";
import { shownTheme } from "../style/theme";
import { shownTextSize } from "../style/text-size";
import { plottedSeries } from "../state/view";
import { catalogue, partsOf, type Series } from "./series";
import { SeriesChart } from "./series-chart";
import { seriesRecording } from "./series-recorder";
import type { Samples } from "./samples";
import type { Extent } from "./visible";

/** Maximum number of series. */
const MOST = 64;

interface Shown extends Series {
  /** Number of its colour: 0 to 7, then again from 0. */
  slot: number;
}

/** Chosen series with their descriptions. */
const shown = computed<Shown[]>(() => {
  const known = new Map(catalogue.value.map((series) => [series.key, series]));
  return plottedSeries.value.map((key, index) => ({ ...(known.get(key) ?? { key, group: "", label: partsOf(key).slice(1).join(" "), unit: "" }), slot: index % 8 }));
});

const charts = new Set<SeriesChart>();

/** Draws all series: the recording, or a copy of it while the plots are paused. */
export function drawSeries(range: (times: Float64Array) => Extent, samples: Samples = seriesRecording): void {
  for (const chart of charts) chart.draw(samples, range(samples.times()));
}

/** Whether any are plotted. */
export const hasSeries = computed(() => shown.value.length > 0);

/** Adds a series. */
export function SeriesPicker(): JSX.Element | null {
  if (plottedSeries.value.length >= MOST) return null;
  const left = catalogue.value.filter(({ key }) => !plottedSeries.value.includes(key));
  const groups = groupedBy(left, ({ group }) => group);
  return (
    <select
      class="picker wide-picker"
      data-testid="series-picker"
      aria-label="Plot anything else"
      title="Plot places of links, contact forces, sensors, parameters, statistics"
      value=""
      onChange={(event) => {
        plottedSeries.value = [...plottedSeries.value, event.currentTarget.value];
        event.currentTarget.value = "";
      }}
    >
      <option value="">+ anything</option>
      {[...groups].map(([group, all]) => (
        <optgroup key={group} label={group}>
          {all.map(({ key, label }) => (
            <option key={key} value={key}>
              {label}
            </option>
          ))}
        </optgroup>
      ))}
    </select>
  );
}

/** The plots and their series. */
export function SeriesPlots({ onZoom, redraw }: { onZoom: (range: Extent | null) => void; redraw: () => void }): JSX.Element | null {
  if (shown.value.length === 0) return null;
  const units = [...groupedBy(shown.value, ({ unit }) => unit)];
  return (
    <>
      <ul class="chips" aria-label="Plotted series">
        {shown.value.map(({ key, group, label, slot }) => (
          <li key={key} class="chip" data-series={slot}>
            <span class="swatch" />
            <span class="chip-name" title={`${group} ${label}`}>
              {label}
            </span>
            <button type="button" aria-label={`Take ${label} out of the plots`} title="Take out of the plots" onClick={() => (plottedSeries.value = plottedSeries.peek().filter((each) => each !== key))}>
              <Icon name="close" />
            </button>
          </li>
        ))}
      </ul>
      <div class="charts series-charts" data-testid="series-plots">
        {units.map(([unit, series]) => (
          <Plot key={unit} unit={unit} series={series} onZoom={onZoom} redraw={redraw} />
        ))}
      </div>
    </>
  );
}

interface PlotProperties {
  unit: string;
  series: readonly Shown[];
  onZoom: (range: Extent | null) => void;
  redraw: () => void;
}

function Plot({ unit, series, onZoom, redraw }: PlotProperties): JSX.Element {
  const host = useRef<HTMLDivElement>(null);
  const readout = useRef<HTMLDivElement>(null);
  const theme = shownTheme.value;
  const size = shownTextSize.value;
  const keys = series.map(({ key, slot }) => `${slot} ${key}`).join("\n");
  useEffect(() => {
    if (!host.current || !readout.current) return undefined;
    const chart = new SeriesChart(host.current, readout.current, series, unit, onZoom);
    charts.add(chart);
    redraw();
    return () => {
      charts.delete(chart);
      chart.destroy();
    };
  }, [keys, theme, size, unit]);
  return (
    <figure class="plot" data-testid="series-plot">
      <figcaption>
        {series.length === 1 ? series[0]?.label : `${series.length} series`} <span class="hint">{unit}</span>
      </figcaption>
      <div ref={host} class="plot-host" />
      <div ref={readout} class="plot-readout" hidden />
    </figure>
  );
}

/** Ordered by the first of each group. */
function groupedBy<T>(items: readonly T[], groupOf: (item: T) => string): Map<string, T[]> {
  const groups = new Map<string, T[]>();
  for (const item of items) {
    const group = groups.get(groupOf(item));
    if (group) group.push(item);
    else groups.set(groupOf(item), [item]);
  }
  return groups;
}
