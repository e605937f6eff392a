// Saves a picture of the scene, at any size.
import type { JSX } from "preact";
import { useState } from "preact/hooks";
import { save } from "../state/download";
import { MAX_SIDE, pictureOpen, takePicture } from "../state/picture";
import { toast } from "../state/toasts";
import { daemonName } from "../state/world";
import { Icon } from "./icons";
import { Sheet } from "./Sheet";

const SIZES: readonly [string, number, number][] = [
  ["Full HD", 1920, 1080],
  ["4K", 3840, 2160],
  ["Square", 2048, 2048],
];

/** Rendered only while it is open. */
export function PictureSheet(): JSX.Element | null {
  if (!pictureOpen.value) return null;
  return (
    <Sheet
      title="Save a picture"
      testId="picture-sheet"
      onClose={() => {
        pictureOpen.value = false;
      }}
    >
      <Form />
    </Sheet>
  );
}

/** Pixels of the view, as it is on the screen. */
function viewSize(): [number, number] {
  const canvas = document.querySelector(".viewport canvas");
  return [Math.max(1, Math.round((canvas?.clientWidth ?? 1280) * devicePixelRatio)), Math.max(1, Math.round((canvas?.clientHeight ?? 720) * devicePixelRatio))];
}

function Form(): JSX.Element {
  const [[width, height], setSize] = useState(viewSize);
  const [busy, setBusy] = useState(false);
  const take = async (): Promise<void> => {
    setBusy(true);
    try {
      save(`${daemonName.peek() || "simd"}-${width}x${height}.png`, await takePicture(width, height));
      pictureOpen.value = false;
    } catch (error) {
      toast("error", error instanceof Error ? error.message : String(error));
      setBusy(false);
    }
  };
  return (
    <form
      class="picture-form"
      onSubmit={(event) => {
        event.preventDefault();
        void take();
      }}
    >
      <p class="hint">What the view shows now, as a PNG, without the page around it and without names.</p>
      <div class="picture-size">
        <Side label="Width" value={width} onChange={(next) => setSize([next, height])} />
        <span aria-hidden="true">×</span>
        <Side label="Height" value={height} onChange={(next) => setSize([width, next])} />
        <span class="hint">pixels</span>
      </div>
      <div class="picture-size" role="group" aria-label="Sizes">
        <button type="button" class="button" onClick={() => setSize(viewSize())}>
          As on the screen
        </button>
        {SIZES.map(([label, wide, high]) => (
          <button key={label} type="button" class="button" title={`${wide} × ${high}`} onClick={() => setSize([wide, high])}>
            {label}
          </button>
        ))}
      </div>
      <button type="submit" class="button primary" data-testid="save-picture" disabled={busy}>
        <Icon name="download" /> Save
      </button>
    </form>
  );
}

function Side({ label, value, onChange }: { label: string; value: number; onChange: (value: number) => void }): JSX.Element {
  return (
    <input
      type="number"
      class="number"
      aria-label={label}
      title={`${label} in pixels, at most ${MAX_SIDE}`}
      data-testid={`picture-${label.toLowerCase()}`}
      min={1}
      max={MAX_SIDE}
      required
      value={Number.isFinite(value) ? value : ""}
      onInput={(event) => onChange(event.currentTarget.valueAsNumber)}
    />
  );
}
