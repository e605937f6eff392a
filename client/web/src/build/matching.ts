// The robots of a world in groups, for a list of hundreds.

/** A line of the list: a heading, or one robot. */
export type Line = { kind: "group"; name: string; robots: readonly string[]; open: boolean } | { kind: "robot"; name: string; indented: boolean };

/** Minimum number of robots with one name before their number that form a group. */
const GROUP = 3;

/** `arm` of `arm_12`, `arm-12` and `arm12`; the name itself of all others. */
export function stemOf(name: string): string {
  return /^(.*?)[_-]?\d+$/.exec(name)?.[1] || name;
}

/**
 * Returns lines for the robots whose names contain all words of `filter`, in the order of the world. Robots of one stem stand
 * together, at the place of the first. Groups in `closed` show only their heading; a filter opens all groups.
 */
export function linesOf(names: readonly string[], filter: string, closed: ReadonlySet<string>): Line[] {
  const words = filter.toLowerCase().split(/\s+/).filter((word) => word !== "");
  const found = names.filter((name) => words.every((word) => name.toLowerCase().includes(word)));
  const groups = new Map<string, string[]>();
  for (const name of found) groups.set(stemOf(name), [...(groups.get(stemOf(name)) ?? []), name]);
  return [...groups].flatMap(([stem, robots]): Line[] => {
    if (robots.length < GROUP) return robots.map((name) => ({ kind: "robot", name, indented: false }));
    const open = words.length > 0 || !closed.has(stem);
    return [{ kind: "group", name: stem, robots, open }, ...(open ? robots.map((name): Line => ({ kind: "robot", name, indented: true })) : [])];
  });
}

/**
 * Returns which of `count` lines of `height` pixels are in view, with some beyond both ends: the first, and the one after the
 * last.
 */
export function inView(top: number, seen: number, height: number, count: number, beyond = 8): [number, number] {
  const first = Math.max(0, Math.floor(top / height) - beyond);
  return [Math.min(first, count), Math.min(count, Math.ceil((top + seen) / height) + beyond)];
}
