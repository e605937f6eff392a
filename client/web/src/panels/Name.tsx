// A name that is shortened in its middle where there is no room: names of one kind often differ at their ends.
import type { JSX } from "preact";

/** Characters at the end that are always shown. */
const END = 12;

const letters = new Intl.Segmenter(undefined, { granularity: "grapheme" });

/** A name in two parts, of which the first may be shortened, cut between what readers take for letters. Short names have no second part. */
export function splitName(name: string): [string, string] {
  // Only the ends of a name are read, even if it has megabytes.
  if (name.length < 2 * END) return [name, ""];
  const tail = [...letters.segment(name.slice(-8 * END))];
  const end = tail.slice(-END).map(({ segment }) => segment).join("");
  return end.length === name.length ? [name, ""] : [name.slice(0, -end.length), end];
}

/** The name, in the direction of its script; all of it is the tooltip. */
export function Name({ name, title = name }: { name: string; title?: string }): JSX.Element {
  const [start, end] = splitName(name);
  return (
    <span class="name" dir="auto" title={title}>
      <span class="start">{start}</span>
      {end !== "" && <span class="end">{end}</span>}
    </span>
  );
}
