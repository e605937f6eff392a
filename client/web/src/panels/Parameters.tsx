// Sliders and buttons that programs have added.
import type { JSX } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import { pressButton, setParameter } from "../daemon/actions";
import { whyNotChange } from "../state/permission";
import { toast } from "../state/toasts";
import { parameters, type Parameter } from "../state/world";
import { compute } from "./expression";
import { useKeptSelection } from "./kept-selection";
import { shortened } from "./quantity";
import { niceStep } from "./range";

/** All parameters, in the order of the daemon. */
export function Parameters(): JSX.Element | null {
  if (parameters.value.length === 0) return null;
  return (
    <section class="parameters" aria-label="Parameters">
      <h2>Parameters</h2>
      {parameters.value.map((parameter) =>
        parameter.kind === "button" ? (
          <button
            key={parameter.name}
            type="button"
            class="button parameter-button"
            data-testid={`parameter-${parameter.name}`}
            title={whyNotChange.value || `Pressed ${parameter.presses} times`}
            disabled={whyNotChange.value !== ""}
            onClick={() => void pressButton(parameter.name)}
          >
            {parameter.name}
          </button>
        ) : (
          <ParameterSlider key={parameter.name} parameter={parameter} />
        ),
      )}
    </section>
  );
}

/** Milliseconds after the daemon's answer from which a value that it never reports is no longer shown. */
const PENDING_TIMEOUT = 1500;

function ParameterSlider({ parameter }: { parameter: Parameter }): JSX.Element {
  const { name, minimum, maximum } = parameter;
  const [own, setOwn] = useState<{ value: number; isAnswered: boolean } | null>(null);
  /** Text of the number box while it is edited: the list is rendered again whenever any parameter changes. */
  const [typed, setTyped] = useState<string | null>(null);
  const dragging = useRef(false);
  const box = useRef<HTMLInputElement>(null);
  useKeptSelection(box);
  // A refused value must not be shown until the next change of the parameters.
  useEffect(() => {
    if (!own?.isAnswered) return undefined;
    const timer = setTimeout(() => {
      if (!dragging.current) setOwn(null);
    }, PENDING_TIMEOUT);
    return () => clearTimeout(timer);
  }, [own]);
  const value = own?.value ?? parameter.value;
  const set = (next: number): void => {
    if (!Number.isFinite(next)) return;
    const within = Math.min(maximum, Math.max(minimum, next));
    setOwn({ value: within, isAnswered: false });
    void setParameter(name, within).then(() => setOwn((last) => (last?.value === within ? { value: within, isAnswered: true } : last)));
  };
  const nudge = (event: KeyboardEvent): void => {
    const direction = { ArrowUp: 1, ArrowRight: 1, ArrowDown: -1, ArrowLeft: -1 }[event.key];
    if (direction === undefined) return;
    // In a text field the horizontal arrow keys move the caret.
    if (direction !== 0 && event.currentTarget instanceof HTMLInputElement && event.currentTarget.type === "text" && /Left|Right/.test(event.key)) return;
    event.preventDefault();
    setTyped(null);
    const step = niceStep((maximum - minimum) / 200);
    set(Math.round((value + direction * step * (event.shiftKey ? 10 : 1)) / step) * step);
  };
  const take = (): void => {
    setTyped(null);
    // The shown text is rounded: if it was not edited, the value must not change.
    if (typed === null || typed === shortened(value)) return;
    const number = valueOf(typed);
    if (Number.isFinite(number)) set(number);
    else toast("error", `${name}: "${typed}" is not a number.`);
  };
  const release = (): void => {
    dragging.current = false;
    setOwn((last) => last && { ...last });
  };
  return (
    <div class="parameter" data-testid={`parameter-${name}`}>
      <span class="joint-name" title={parameter.joint === "" ? name : `${name}: sets the target of ${parameter.joint}`}>
        {name}
        {parameter.joint !== "" && <span class="parameter-joint"> → {parameter.joint}</span>}
      </span>
      <div class="joint-line">
        <span class="bound">{shortened(minimum)}</span>
        <div class="slider plain">
          <div class="rail" />
          <input
            type="range"
            min={minimum}
            max={maximum}
            step="any"
            value={value}
            data-testid="parameter-slider"
            aria-label={name}
            title={whyNotChange.value}
            disabled={whyNotChange.value !== ""}
            onPointerDown={() => {
              dragging.current = true;
            }}
            onPointerUp={release}
            onPointerCancel={release}
            onInput={(event) => set(event.currentTarget.valueAsNumber)}
            onKeyDown={nudge}
          />
        </div>
        <span class="bound">{shortened(maximum)}</span>
        <input
          ref={box}
          class="number"
          type="text"
          inputMode="decimal"
          data-testid="parameter-number"
          aria-label={`${name}, as a number`}
          title={whyNotChange.value}
          disabled={whyNotChange.value !== ""}
          value={typed ?? shortened(value)}
          onFocus={(event) => event.currentTarget.select()}
          onInput={(event) => setTyped(event.currentTarget.value)}
          onBlur={take}
          onKeyDown={(event) => {
            if (event.key === "Enter") take();
            else if (event.key === "Escape") setTyped(null);
            else nudge(event);
          }}
        />
      </div>
    </div>
  );
}

/** Returns the value of the typed expression; NaN if it has none. */
function valueOf(text: string): number {
  try {
    return compute(text.trim()).value;
  } catch {
    return NaN;
  }
}
