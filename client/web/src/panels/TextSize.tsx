// Size of text and controls: by the width of the window, or as the user chooses.
import type { JSX } from "preact";
import { textSize, type TextSize as Size } from "../state/view";
import { Popover } from "./Popover";

const SIZES: readonly [Size, string][] = [
  ["auto", "auto"],
  ["100", "100 %"],
  ["125", "125 %"],
  ["150", "150 %"],
  ["200", "200 %"],
];

/** A button of the top bar, with the choice. */
export function TextSize(): JSX.Element {
  return (
    <Popover class="button quiet sign" testId="text-size" label="Text size" title="Text size" face="Aa">
      {() => (
        <div class="segments" role="group" aria-label="Text size">
          {SIZES.map(([size, label]) => (
            <button
              key={size}
              type="button"
              data-testid={`text-size-${size}`}
              aria-pressed={textSize.value === size}
              title={size === "auto" ? "Larger in wide windows" : `${label} of the size of the browser`}
              onClick={() => {
                textSize.value = size;
              }}
            >
              {label}
            </button>
          ))}
        </div>
      )}
    </Popover>
  );
}
