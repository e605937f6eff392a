// Records the plotted series from each state that the page receives, once the drawer's code is loaded.
import { effect } from "@preact/signals";
import { plottedSeries } from "../state/view";
import { frame, type Frame } from "../state/world";
import { Samples } from "./samples";
import { valueOf } from "./series";

/** Simulated seconds that are kept: ten minutes. */
export const SERIES_SPAN = 600;
const MAX_SAMPLES = 40_000;

export const seriesRecording = new Samples(SERIES_SPAN, MAX_SAMPLES);
let before: Frame | null = null;

effect(() => {
  const wanted = plottedSeries.value;
  for (const name of seriesRecording.names) {
    if (!wanted.includes(name)) seriesRecording.remove(name);
  }
  for (const name of wanted) seriesRecording.add(name);
});

effect(() => {
  const now = frame.value;
  if (!now || now === before) return;
  if (before?.epoch !== now.epoch) seriesRecording.clear();
  if (plottedSeries.peek().length > 0) seriesRecording.push(now.simTime, (name) => valueOf(name, now, before));
  before = now;
});
