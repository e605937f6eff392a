// A name that is shortened in its middle if space is short: names of one kind often differ at their ends.
import type { JSX } from "preact";

/** Characters at the end that are always shown. */
const END = 12;

const letters = new Intl.Segmenter(undefined, { granularity: "grapheme" });

/**
 * Splits a name into two parts, of which the first may be shortened. The cut is between letters as readers see them. Short names have no
 * second part.
 */
export function splitName(name: string): [string, string] {
  // Only the ends of a name are read, even if it has megabytes.
  if (name.length < 2 * END) return [name, ""];
  const tail = [...letters.segment(name.slice(-8 * END))];
  const end = tail.slice(-END).map(({ segment }) => segment).join("");
  return end.length === name.length ? [name, ""] : [name.slice(0, -end.length), end];
}

/** The name, in the direction of its script; the tooltip has it in full. */
export function Name({ name, title = name }: { name: string; title?: string }): JSX.Element {
  const [start, end] = splitName(name);
  return (
    <span class="name" dir="auto" title={title}>
      <span class="start">{start}</span>
      {end !== "" && <span class="end">{end}</span>}
    </span>
  );
}
