// The page: the bar, the world, and the panels around it.
import "../style/tokens.css";
import "../style/base.css";
import "../style/layout.css";
import "../style/top-bar.css";
import "../style/joints.css";
import "../style/plots.css";
import "../style/overlays.css";
import "../style/theme";
import { useComputed } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect } from "preact/hooks";
import { PlotsDrawer } from "../plots/PlotsDrawer";
import { Viewport } from "../scene/Viewport";
import { loading } from "../state/report";
import { panelOpen, plotsOpen } from "../state/view";
import { connection, frame, robots } from "../state/world";
import { Banner } from "./Banner";
import { DropOverlay } from "./DropOverlay";
import { EmptyWorld } from "./EmptyWorld";
import { HelpSheet } from "./HelpSheet";
import { JointPanel } from "./JointPanel";
import { LoadProgress } from "./LoadProgress";
import { ReportSheet } from "./ReportSheet";
import { listen } from "./shortcuts";
import { Toasts } from "./Toasts";
import { TopBar } from "./TopBar";
import { ViewToggles } from "./ViewToggles";

/** All of it. */
export function App(): JSX.Element {
  useEffect(listen, []);
  const state = useComputed(() => connection.value.state).value;
  const empty = useComputed(() => connection.value.state === "live" && robots.value.length === 0 && frame.value !== null && loading.value === null).value;
  return (
    <div class="app" data-connection={state}>
      <TopBar />
      <main class="view" aria-label="The world">
        <Viewport />
        <Banner />
        <LoadProgress />
        {empty && <EmptyWorld />}
        <ViewToggles />
      </main>
      {panelOpen.value && (
        <aside class="panel" aria-label="Joints and parameters" data-testid="panel">
          <JointPanel />
        </aside>
      )}
      {plotsOpen.value && <PlotsDrawer />}
      <Toasts />
      <ReportSheet />
      <HelpSheet />
      <DropOverlay />
    </div>
  );
}
