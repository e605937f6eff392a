// The help: how to begin, and all keys and gestures.
import type { JSX } from "preact";
import { Guide } from "./Guide";
import { Sheet } from "./Sheet";
import { helpOpen, SHORTCUTS } from "./shortcuts";

/** Mouse and touch gestures in the view. */
const GESTURES: readonly [string, string][] = [
  ["Drag", "Orbit"],
  ["Right drag, two fingers", "Pan"],
  ["Wheel, pinch", "Zoom"],
  ["Double click", "Fit the robot, or everything"],
  ["Click on a robot", "Show its joints"],
  ["Drag a link", "Pull it with a spring, while playing"],
];

/** On a slider or in a number box. */
const FIELDS: readonly [string, string][] = [
  ["Arrow keys", "Nudge the target"],
  ["Shift + arrow keys", "Nudge ten times as far"],
  ["90 deg, pi/2, 2*(0.1 + 0.2)", "Type a value with or without a unit, or compute it; Enter sets it"],
  ["Escape", "Restore the field; close what is open"],
];

/** Rendered only while it is open. */
export function HelpSheet(): JSX.Element | null {
  const part = helpOpen.value;
  if (part === null) return null;
  return (
    <Sheet
      title="Help"
      testId="help-sheet"
      onClose={() => {
        helpOpen.value = null;
      }}
    >
      <div class="segments help-parts" role="group" aria-label="What is shown">
        {PARTS.map(([value, label]) => (
          <button key={value} type="button" data-testid={`help-${value}`} aria-pressed={part === value} onClick={() => (helpOpen.value = value)}>
            {label}
          </button>
        ))}
      </div>
      {part === "begin" ? <Guide /> : <AllKeys />}
    </Sheet>
  );
}

const PARTS = [
  ["begin", "How to begin"],
  ["keys", "Keys and gestures"],
] as const;

function AllKeys(): JSX.Element {
  return (
    <div class="help">
      <Keys heading="Keys" rows={SHORTCUTS.map(({ shown, what }) => [shown, what])} />
      <div class="wide">
        <Keys heading="In the view" rows={GESTURES} />
        <Keys heading="On a joint" rows={FIELDS} />
      </div>
    </div>
  );
}

function Keys({ heading, rows }: { heading: string; rows: readonly (readonly [string, string])[] }): JSX.Element {
  return (
    <section>
      <h3>{heading}</h3>
      <dl>
        {rows.map(([key, what]) => (
          <div key={key}>
            <dt>
              <kbd>{key}</kbd>
            </dt>
            <dd>{what}</dd>
          </div>
        ))}
      </dl>
    </section>
  );
}
