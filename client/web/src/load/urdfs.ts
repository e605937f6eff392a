// Which of the dropped files describe robots.
import { nameOf, parent } from "./tree";

/** More at once is a collection, of which people mean one. */
const MOST = 4;

/** The URDF files to load, sorted. Throws a sentence where there is none, or too many to be meant. */
export function findUrdfs(paths: string[]): string[] {
  const urdfs = paths.filter((path) => /\.urdf$/i.test(path)).sort();
  if (urdfs.length === 0) throw new Error(nothing(paths));
  // Those that lie highest: tests and examples are farther down. A folder `urdf` counts as what it is in.
  const level = (path: string) => path.split("/").length - (nameOf(parent(path)) === "urdf" ? 1 : 0);
  const highest = Math.min(...urdfs.map(level));
  const meant = urdfs.filter((path) => level(path) === highest);
  if (meant.length > MOST) {
    const names = meant.slice(0, MOST).map(nameOf).join(", ");
    throw new Error(`There are ${meant.length} .urdf files (${names}, ...): drop a folder that holds only the one to load.`);
  }
  return meant;
}

function nothing(paths: string[]): string {
  const xacro = paths.find((path) => /\.xacro$/i.test(path));
  return xacro === undefined
    ? "There is no .urdf file in what was dropped: drop the robot's folder, or its .urdf with its meshes."
    : `${nameOf(xacro)} is a xacro file: run \`xacro\` on it, or \`simctl robot load\`, which does.`;
}
