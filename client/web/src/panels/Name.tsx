// A name that is shortened in its middle if space is short: names of one kind often differ at their ends.
import type { JSX } from "preact";

/** Columns at the end that are always shown: a letter takes one, a wide one two. */
const END = 12;

const letters = new Intl.Segmenter(undefined, { granularity: "grapheme" });
const WIDE = /[\p{Script=Han}\p{Script=Hiragana}\p{Script=Katakana}\p{Script=Hangul}\p{Extended_Pictographic}\u{ff00}-\u{ff60}]/u;

/**
 * Splits a name into two parts, of which the first may be shortened. The cut is between letters as readers see them. Short names have no
 * second part.
 */
export function splitName(name: string): [string, string] {
  // Only the ends of a name are read, even if it has megabytes.
  const tail = [...letters.segment(name.slice(-16 * END))].map(({ segment }) => segment).toReversed();
  let [columns, end] = [0, ""];
  for (const letter of tail) {
    columns += WIDE.test(letter) ? 2 : 1;
    if (columns <= END) end = letter + end;
  }
  return columns < 2 * END ? [name, ""] : [name.slice(0, -end.length), end];
}

/** The name, in the direction of its script; the tooltip has it in full. */
export function Name({ name, title = name }: { name: string; title?: string }): JSX.Element {
  const [start, end] = splitName(name);
  return (
    <span class="name" dir="auto" title={title}>
      <span class="start">{start}</span>
      {end !== "" && (
        <span class="end">
          <bdi>{end}</bdi>
        </span>
      )}
    </span>
  );
}
