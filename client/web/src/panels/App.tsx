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
import { effect, useComputed } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect } from "preact/hooks";
import { LazyPlots } from "../plots/LazyPlots";
import { Viewport } from "../scene/Viewport";
import { playback } from "../state/playback";
import { loading } from "../state/report";
import { panelOpen, panelWidth, plotsOpen } from "../state/view";
import { connection, frame, parameters, robots } from "../state/world";
import { Banner } from "./Banner";
import { DropOverlay } from "./DropOverlay";
import { EmptyWorld } from "./EmptyWorld";
import { GuideSheet } from "./GuideSheet";
import { HelpSheet } from "./HelpSheet";
import { InputNote } from "./InputNote";
import { JointPanel } from "./JointPanel";
import { LoadProgress } from "./LoadProgress";
import { LogIn } from "./LogIn";
import { PanelEdge } from "./PanelEdge";
import { PictureSheet } from "./PictureSheet";
import { RecordingsSheet } from "./RecordingsSheet";
import { ReportSheet } from "./ReportSheet";
import { listen } from "./shortcuts";
import { Toasts } from "./Toasts";
import { TopBar } from "./TopBar";
import { ViewToggles } from "./ViewToggles";

/** The whole page. */
export function App(): JSX.Element {
  useEffect(listen, []);
  useEffect(keepOneOpenOnPhones, []);
  const state = useComputed(() => connection.value.state).value;
  const needsToken = useComputed(() => connection.value.needsToken === true).value;
  const empty = useComputed(() => connection.value.state === "live" && robots.value.length === 0 && frame.value !== null && loading.value === null && playback.value === null).value;
  /** The panel would be empty. */
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
        <ViewToggles />
        <Toasts />
      </main>
      {panelOpen.value && !bare && (
        <aside class="panel" aria-label="Joints and parameters" data-testid="panel" style={panelWidth.value === null ? {} : { "--panel-width": `${panelWidth.value}rem` }}>
          <PanelEdge />
          <JointPanel />
        </aside>
      )}
      <Recorded />
      <RecordingsSheet />
      <ReportSheet />
      <HelpSheet />
      <GuideSheet />
      <PictureSheet />
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

/** A phone has no room for both plots and panel: the one that was opened last stays open. */
function keepOneOpenOnPhones(): () => void {
  const narrow = matchMedia("(max-width: 760px)");
  let before = { plots: plotsOpen.peek(), panel: panelOpen.peek() };
  return effect(() => {
    const now = { plots: plotsOpen.value, panel: panelOpen.value };
    if (narrow.matches && now.plots && now.panel) {
      if (before.plots) plotsOpen.value = false;
      else panelOpen.value = false;
    }
    before = { plots: plotsOpen.peek(), panel: panelOpen.peek() };
  });
}
