// Groups joints under headings by the first words of their names.

/** Rows under one heading, which may be empty. */
export interface Group<T> {
  heading: string;
  /** In their order, with the rest of each name. */
  rows: { item: T; label: string }[];
}

/** Lists with fewer rows than this have no headings. */
const MIN_ROWS = 10;
/** A larger group is split again if the parts have at least `FEW` rows. */
const LARGE = 10;
const FEW = 2;

/** Words of a name: at `_`, `-`, `.`, blanks, and where a capital follows a small letter. */
function words(name: string): string[] {
  return name
    .replace(/([a-z])([A-Z])/g, "$1_$2")
    .split(/[_\-. /]+/)
    .filter((word) => word !== "");
}

/** Groups rows whose names share their first words, if they are many. Groups are in the order of their first rows. */
export function grouped<T>(items: readonly T[], nameOf: (item: T) => string): Group<T>[] {
  const plain = items.map((item) => ({ item, label: nameOf(item) }));
  if (items.length < MIN_ROWS) return [{ heading: "", rows: plain }];
  const entries = plain.map(({ item, label }) => ({ item, label, words: words(label) }));
  // Words at the start of all names are not a heading.
  const shared = sharedWords(entries.map((entry) => entry.words));
  const split = splitBy(entries, shared);
  if (split.length < 2) return [{ heading: "", rows: plain }];
  return split.map(({ depth, rows }) => {
    const heading = depth === 0 ? "" : (rows[0]?.words.slice(shared, shared + depth).join(" ") ?? "");
    return { heading, rows: rows.map(({ item, label, words: all }) => ({ item, label: depth === 0 ? label : rest(all, shared + depth, label) })) };
  });
}

interface Entry<T> {
  item: T;
  label: string;
  words: string[];
}

/** Returns how many first words all names share; at least two words remain of each name. */
function sharedWords(all: string[][]): number {
  const first = all[0] ?? [];
  const shortest = Math.min(...all.map((one) => one.length));
  let count = 0;
  while (count < shortest - 2 && all.every((one) => one[count] === first[count])) count += 1;
  return count;
}

/**
 * Groups by the word at `from`; `depth` is the number of words that the names of the group share there. Rows without a
 * group come first, so that they do not look like part of the group above them.
 */
function splitBy<T>(entries: Entry<T>[], from: number): { depth: number; rows: Entry<T>[] }[] {
  const groups: { depth: number; rows: Entry<T>[] }[] = [];
  const alone: Entry<T>[] = [];
  for (const rows of collect(entries, from).values()) {
    if (rows.length < FEW) {
      alone.push(...rows);
      continue;
    }
    const finer = rows.length > LARGE ? [...collect(rows, from + 1).values()] : [];
    if (finer.length > 1 && finer.every((part) => part.length >= FEW)) groups.push(...finer.map((part) => ({ depth: 2, rows: part })));
    else groups.push({ depth: 1, rows });
  }
  return alone.length > 0 ? [{ depth: 0, rows: alone }, ...groups] : groups;
}

/** Groups entries by one of their words; a name without further words has a separate group. */
function collect<T>(entries: Entry<T>[], at: number): Map<string, Entry<T>[]> {
  const by = new Map<string, Entry<T>[]>();
  for (const entry of entries) {
    const word = entry.words.length > at + 1 ? (entry.words[at] ?? "") : `\u0000${entry.label}`;
    by.set(word, [...(by.get(word) ?? []), entry]);
  }
  return by;
}

/** The name without its first `skip` words. */
function rest(all: string[], skip: number, label: string): string {
  const left = all.slice(skip).join(" ");
  return left === "" ? label : left;
}


/** A part of a name, and whether it matches a word of the filter. */
export interface Part {
  text: string;
  found: boolean;
}

/** Splits a name into parts, and marks the parts that the filter found. */
export function foundIn(name: string, filter: string): Part[] {
  const plain = name.toLowerCase();
  const marked = new Array<boolean>(name.length).fill(false);
  for (const word of filter.toLowerCase().split(/\s+/).filter((each) => each !== "")) {
    for (let at = plain.indexOf(word); at >= 0; at = plain.indexOf(word, at + 1)) marked.fill(true, at, at + word.length);
  }
  const parts: Part[] = [];
  [...marked.keys()].forEach((at) => {
    const found = marked[at] ?? false;
    const last = parts.at(-1);
    if (last?.found === found) last.text += name.charAt(at);
    else parts.push({ text: name.charAt(at), found });
  });
  return parts;
}

/** Whether a name contains all words of the filter, in any order. */
export function matches(name: string, filter: string): boolean {
  const plain = name.toLowerCase();
  return filter
    .toLowerCase()
    .split(/\s+/)
    .every((word) => plain.includes(word));
}
