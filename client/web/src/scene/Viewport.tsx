// The 3D view: a canvas that fills its parent.
import { signal } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { hook } from "./hook";
import { Stage } from "./stage";

/** Reason why nothing can be drawn; empty if it can. */
const problem = signal("");

/** Draws the world; the camera can be moved, robots selected and links pulled. */
export function Viewport(): JSX.Element {
  const holder = useRef<HTMLDivElement>(null);
  const canvas = useRef<HTMLCanvasElement>(null);
  useEffect(() => (holder.current && canvas.current ? begin(holder.current, canvas.current) : undefined), []);
  return (
    <div class="viewport" ref={holder} style={{ position: "absolute", inset: 0, overflow: "hidden" }}>
      <canvas
        ref={canvas}
        data-testid="viewport"
        tabIndex={0}
        role="application"
        aria-label="The simulated world. Drag or arrow keys to orbit, with Shift to pan, scroll or plus and minus to zoom, F to fit."
        style={{ display: "block", width: "100%", height: "100%", touchAction: "none" }}
      />
      {problem.value !== "" && (
        <p class="card" role="alert" data-testid="viewport-problem">
          {problem.value}
        </p>
      )}
    </div>
  );
}

function begin(holder: HTMLDivElement, canvas: HTMLCanvasElement): (() => void) | undefined {
  let stage: Stage;
  try {
    stage = new Stage(canvas);
  } catch {
    problem.value =
      "This browser cannot draw in three dimensions: WebGL 2 is missing or switched off. Switch on hardware acceleration in its settings, or take another browser. Panel, sliders and plots work.";
    return undefined;
  }
  problem.value = "";
  const fill = () => stage.resize(holder.clientWidth, holder.clientHeight);
  const size = new ResizeObserver(fill);
  size.observe(holder);
  fill();
  const lost = () => {
    problem.value = "The browser stopped the graphics of this page. The picture returns when the browser restores them; if it does not, reload the page. Everything else works.";
  };
  // Registered after the renderer, which listens too.
  const restored = () => {
    problem.value = "";
    stage.appearance.restored();
  };
  canvas.addEventListener("webglcontextlost", lost);
  canvas.addEventListener("webglcontextrestored", restored);
  const unhook = hook(stage, canvas);
  return () => {
    size.disconnect();
    canvas.removeEventListener("webglcontextlost", lost);
    canvas.removeEventListener("webglcontextrestored", restored);
    unhook();
    stage.dispose();
  };
}
