// The page: the top bar, the view, and the panels around it.
import "../style/tokens.css";
import "../style/base.css";
import "../style/layout.css";
import "../style/top-bar.css";
import "../style/robots.css";
import "../style/joints.css";
import "../style/sliders.css";
import "../style/plots.css";
import "../style/recordings.css";
import "../style/overlays.css";
import "../style/sheets.css";
import "../style/text-size";
import "../style/theme";
import { room } from "../style/room";
import { effect, useComputed } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect } from "preact/hooks";
import { LazyPlots } from "../plots/LazyPlots";
import { Viewport } from "../scene/Viewport";
import { film } from "../state/film";
import { playback } from "../state/playback";
import { pictureOpen } from "../state/picture";
import { recordingsOpen } from "../state/recordings";
import { loading } from "../state/report";
import { placing, tool } from "../state/tools";
import { panelOpen, panelWidth, plotsOpen } from "../state/view";
import { connection, frame, parameters, robots } from "../state/world";
import { Banner } from "./Banner";
import { DropOverlay } from "./DropOverlay";
import { EmptyWorld } from "./EmptyWorld";
import { InputNote } from "./InputNote";
import { JointPanel } from "./JointPanel";
import { lazy } from "./lazy";
import { LoadProgress } from "./LoadProgress";
import { LogIn } from "./LogIn";
import { PanelEdge } from "./PanelEdge";
import { ReportSheet } from "./ReportSheet";
import { RestartNote } from "./RestartNote";
import { helpOpen, listen } from "./shortcuts";
import { Toasts } from "./Toasts";
import { TopBar } from "./TopBar";
import { ViewToggles } from "./ViewToggles";
import { keepTitle } from "./title";

// Parts that most visits never open.
const RecordingsSheet = lazy(async () => (await import("./RecordingsSheet")).RecordingsSheet, "The list of recordings", () => (recordingsOpen.value = false));
const HelpSheet = lazy(async () => (await import("./HelpSheet")).HelpSheet, "The help", () => (helpOpen.value = null));
const PictureSheet = lazy(async () => (await import("./PictureSheet")).PictureSheet, "The sheet for pictures", () => (pictureOpen.value = false));
const ToolSheet = lazy(async () => (await import("../build")).ToolSheet, "The tool", () => (tool.value = null));
const PlaceCard = lazy(async () => (await import("../build")).PlaceCard, "The tool", () => (placing.value = null));
const FilmNote = lazy(async () => (await import("../build")).FilmNote, "The tool");

/** The whole page. */
export function App(): JSX.Element {
  useEffect(listen, []);
  useEffect(keepOneOpenOnPhones, []);
  useEffect(keepTitle, []);
  const state = useComputed(() => connection.value.state).value;
  const needsToken = useComputed(() => connection.value.needsToken === true).value;
  const empty = useComputed(() => connection.value.state === "live" && robots.value.length === 0 && frame.value !== null && loading.value === null && playback.value === null).value;
  /** Without robots the panel would be empty. */
  const bare = useComputed(() => robots.value.length === 0 && parameters.value.length === 0).value;
  return (
    <div class="app" data-connection={state}>
      <TopBar />
      <main class="view" aria-label="The world">
        <Viewport />
        <Banner />
        {needsToken && <LogIn />}
        <LoadProgress />
        {empty && <EmptyWorld />}
        <InputNote />
        <RestartNote />
        {placing.value && <PlaceCard />}
        {film.value && <FilmNote />}
        <div class="view-foot">
          <Toasts />
          <ViewToggles />
        </div>
      </main>
      {panelOpen.value && !bare && (
        <aside class="panel" aria-label="Joints and parameters" data-testid="panel" style={panelWidth.value === null ? {} : { "--panel-width": `${panelWidth.value}rem` }}>
          <PanelEdge />
          <JointPanel />
        </aside>
      )}
      <Recorded />
      {recordingsOpen.value && <RecordingsSheet />}
      <ReportSheet />
      {helpOpen.value && <HelpSheet />}
      {pictureOpen.value && <PictureSheet />}
      {tool.value && <ToolSheet />}
      <DropOverlay />
    </div>
  );
}

/** The bar of a recording, if one is shown; then the plots, of the recording or of the world. */
function Recorded(): JSX.Element {
  const shown = playback.value;
  if (!shown) return <>{plotsOpen.value && <LazyPlots />}</>;
  const { player, module } = shown;
  return (
    <>
      <module.PlaybackBar key={player.name} player={player} />
      {plotsOpen.value && <module.PlaybackPlots player={player} />}
    </>
  );
}

/** A phone has no room for both plots and panel: the one opened last stays open. */
function keepOneOpenOnPhones(): () => void {
  let before = { plots: plotsOpen.peek(), panel: panelOpen.peek() };
  return effect(() => {
    const now = { plots: plotsOpen.value, panel: panelOpen.value };
    if (room.peek() === "tall" && now.plots && now.panel) {
      if (before.plots) plotsOpen.value = false;
      else panelOpen.value = false;
    }
    before = { plots: plotsOpen.peek(), panel: panelOpen.peek() };
  });
}
