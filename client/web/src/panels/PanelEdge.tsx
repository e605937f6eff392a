// The edge of the side panel, which the user drags to widen it: long names need the room.
import type { JSX } from "preact";
import { panelWidth } from "../state/view";

/** Bounds in rem; the default is the style sheet's. */
const NARROWEST = 18;
const WIDEST = 60;
const DEFAULT = 24;
const STEP = 1;

function rem(): number {
  return parseFloat(getComputedStyle(document.documentElement).fontSize) || 16;
}

function set(width: number): void {
  // The style sheet's value.
  const most = Math.max(NARROWEST, Math.min(WIDEST, (0.6 * innerWidth) / rem()));
  panelWidth.value = Math.round(10 * Math.min(most, Math.max(NARROWEST, width))) / 10;
}

/** A separator that takes the pointer and the arrow keys; a double click restores the default. */
export function PanelEdge(): JSX.Element {
  const width = panelWidth.value ?? DEFAULT;
  return (
    <div
      class="panel-edge"
      role="separator"
      aria-orientation="vertical"
      aria-label="Width of the side panel"
      aria-valuenow={Math.round(width)}
      aria-valuemin={NARROWEST}
      aria-valuemax={WIDEST}
      tabIndex={0}
      title="Drag to make the panel wider; double click for the usual width"
      data-testid="panel-edge"
      onPointerDown={(event) => {
        if (event.button !== 0) return;
        event.preventDefault();
        event.currentTarget.setPointerCapture(event.pointerId);
      }}
      onPointerMove={(event) => {
        if (event.currentTarget.hasPointerCapture(event.pointerId)) set((innerWidth - event.clientX) / rem());
      }}
      onDblClick={() => {
        panelWidth.value = null;
      }}
      onKeyDown={(event) => {
        const direction = { ArrowLeft: 1, ArrowRight: -1 }[event.key];
        if (direction === undefined) return;
        event.preventDefault();
        set(width + direction * STEP);
      }}
    />
  );
}
