// Fields of the forms of tools: numbers with units, and choices.
import type { JSX } from "preact";
import { useRef, useState } from "preact/hooks";
import { useKeptSelection } from "../panels/kept-selection";
import { parse, shortened } from "../panels/quantity";

interface NumberProperties {
  label: string;
  testId: string;
  /** SI; undefined shows the placeholder. */
  value: number | undefined;
  placeholder?: string;
  kind?: "length" | "angle" | "number";
  /**
   * The text takes effect with Enter or on leaving the field, not with each key, because it moves something at once. Escape restores the
   * old text.
   */
  whenEntered?: boolean;
  onChange: (value: number) => void;
  /** Called if the text is empty. Without it, an empty text is a problem. */
  onClear?: () => void;
}

const UNITS = { length: { name: "m", scale: 1 }, angle: { name: "deg", scale: Math.PI / 180 }, number: { name: "", scale: 1 } } as const;

/** A number that is typed with any unit, or computed, and changed in steps by the arrows. Angles without a unit are degrees. */
export function NumberField({ label, testId, value, placeholder = "", kind = "length", whenEntered = false, onChange, onClear }: NumberProperties): JSX.Element {
  const unit = UNITS[kind];
  const [typed, setTyped] = useState<string | null>(null);
  const [problem, setProblem] = useState("");
  const input = useRef<HTMLInputElement>(null);
  useKeptSelection(input);
  const read = (text: string): number | string => {
    if (kind !== "number") return parse(text, kind, "position", unit);
    const number = Number(text.replace(",", "."));
    return text.trim() !== "" && Number.isFinite(number) ? number : `"${text}" is not a number`;
  };
  const take = (text: string): void => {
    if (onClear && text.trim() === "") {
      setProblem("");
      return onClear();
    }
    const result = read(text);
    setProblem(typeof result === "string" ? result : "");
    if (typeof result === "number") onChange(result);
  };
  const putBack = (): void => {
    setTyped(null);
    setProblem("");
  };
  /** Takes the typed text, if any; text that cannot be read stays. */
  const enter = (): void => {
    if (typed === null) return;
    take(typed);
    if (typeof read(typed) === "number") setTyped(null);
  };
  const nudge = (event: KeyboardEvent): void => {
    const way = { ArrowUp: 1, ArrowDown: -1 }[event.key];
    if (way === undefined) return;
    event.preventDefault();
    const step = (kind === "angle" ? 1 : 0.01) * unit.scale * (event.shiftKey ? 10 : 1);
    const from = typed === null ? value : read(typed);
    putBack();
    onChange((typeof from === "number" ? from : (value ?? 0)) + way * step);
  };
  const press = (event: KeyboardEvent): void => {
    if (whenEntered && event.key === "Enter") {
      enter();
    } else if (whenEntered && event.key === "Escape" && typed !== null) {
      // Another Escape closes the surrounding sheet.
      event.stopPropagation();
      putBack();
    } else {
      nudge(event);
    }
  };
  return (
    <label class="build-field">
      <span>
        {label} <span class="hint">{unit.name}</span>
      </span>
      <input
        ref={input}
        type="text"
        class="number"
        inputMode="decimal"
        autocomplete="off"
        spellcheck={false}
        data-testid={testId}
        aria-invalid={problem !== ""}
        title={problem !== "" ? problem : `${label}${unit.name === "" ? "" : `, in ${unit.name} where no unit is written`}`}
        placeholder={placeholder}
        value={typed ?? (value === undefined ? "" : shownNumber(value / unit.scale))}
        onInput={(event) => {
          setTyped(event.currentTarget.value);
          if (whenEntered) setProblem("");
          else take(event.currentTarget.value);
        }}
        onBlur={() => {
          if (whenEntered) enter();
          putBack();
        }}
        onKeyDown={press}
      />
      {problem !== "" && (
        <span class="refusal" role="alert">
          {problem}
        </span>
      )}
    </label>
  );
}

/** Six significant digits, and no trailing ones. */
function shownNumber(value: number): string {
  return Number.isFinite(value) ? String(Number(value.toPrecision(6))) : shortened(value);
}

interface ChoiceProperties<T extends string> {
  label: string;
  testId: string;
  value: T;
  options: readonly (readonly [T, string])[];
  onChange: (value: T) => void;
}

/** One of several. */
export function ChoiceField<T extends string>({ label, testId, value, options, onChange }: ChoiceProperties<T>): JSX.Element {
  return (
    <label class="build-field">
      <span>{label}</span>
      <select data-testid={testId} value={value} onChange={(event) => onChange(event.currentTarget.value as T)}>
        {options.map(([option, text]) => (
          <option key={option} value={option}>
            {text}
          </option>
        ))}
      </select>
    </label>
  );
}

/** A name that a robot can have; empty is left to the daemon. */
export function NameField({ value, placeholder, onChange }: { value: string; placeholder: string; onChange: (value: string) => void }): JSX.Element {
  return (
    <label class="build-field">
      <span>Name</span>
      <input
        type="text"
        class="filter"
        data-testid="build-name"
        placeholder={placeholder}
        pattern="[A-Za-z0-9_\-]*"
        title="Letters, digits, _ and -; a number is added if it is taken"
        maxLength={100}
        autocomplete="off"
        spellcheck={false}
        value={value}
        onInput={(event) => onChange(event.currentTarget.value)}
      />
    </label>
  );
}
