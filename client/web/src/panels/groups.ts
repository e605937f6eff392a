// Joints of a limb under one heading, by what their names begin with.

/** Rows under one heading; the heading is empty where there is none. */
export interface Group<T> {
  heading: string;
  /** In their order, with what is left of each name. */
  rows: { item: T; label: string }[];
}

/** Fewer rows than this are read at once; headings would be in the way. */
const MANY = 10;
/** A group that is larger is split again where that makes groups. */
const LARGE = 10;
const FEW = 2;

/** Words of a name: at `_`, `-`, `.`, blanks, and where a capital follows a small letter. */
function words(name: string): string[] {
  return name
    .replace(/([a-z])([A-Z])/g, "$1_$2")
    .split(/[_\-. /]+/)
    .filter((word) => word !== "");
}

/** Puts rows under headings where there are many and their names share first words. In the order of their first rows. */
export function grouped<T>(items: readonly T[], nameOf: (item: T) => string): Group<T>[] {
  const plain = items.map((item) => ({ item, label: nameOf(item) }));
  if (items.length < MANY) return [{ heading: "", rows: plain }];
  const entries = plain.map(({ item, label }) => ({ item, label, words: words(label) }));
  // What all names begin or end with tells none of them apart.
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

/** How many words all names begin with; each name keeps at least two. */
function sharedWords(all: string[][]): number {
  const first = all[0] ?? [];
  const shortest = Math.min(...all.map((one) => one.length));
  let count = 0;
  while (count < shortest - 2 && all.every((one) => one[count] === first[count])) count += 1;
  return count;
}

/**
 * Groups by the word at `from`; `depth` is how many words the group's names share there. What stands alone comes
 * first, so that it is not read as part of the group above it.
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

/** Entries by one of their words; a name that would have nothing left is by itself. */
function collect<T>(entries: Entry<T>[], at: number): Map<string, Entry<T>[]> {
  const by = new Map<string, Entry<T>[]>();
  for (const entry of entries) {
    const word = entry.words.length > at + 1 ? (entry.words[at] ?? "") : `\u0000${entry.label}`;
    by.set(word, [...(by.get(word) ?? []), entry]);
  }
  return by;
}

/** The name after its first `skip` words, as it is written. */
function rest(all: string[], skip: number, label: string): string {
  const left = all.slice(skip).join(" ");
  return left === "" ? label : left;
}

/** Whether a name has all words of what was typed, in any order. */
export function matches(name: string, filter: string): boolean {
  const plain = name.toLowerCase();
  return filter
    .toLowerCase()
    .split(/\s+/)
    .every((word) => plain.includes(word));
}
