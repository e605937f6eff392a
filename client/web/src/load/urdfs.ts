// Which of the dropped files describe robots.
import { nameOf, parent } from "./tree";

/** More files than this are a collection, of which the user wants one. */
const MAX_URDFS = 4;

/** The descriptions to load, sorted: URDFs, or where there are none SDFs, or MJCFs. Throws an error for the user if there are
 * none, or too many. */
export function findUrdfs(paths: string[]): string[] {
  const of = (ending: RegExp) => paths.filter((path) => ending.test(path)).sort();
  const kinds = [/\.urdf$/i, /\.(sdf|world)$/i, /\.mjcf$/i, /(?<!\/(package|plugin|manifest))\.xml$/i];
  const urdfs = kinds.map(of).find((found) => found.length > 0) ?? [];
  if (urdfs.length === 0) throw new Error("There is no .urdf file in what was dropped, nor a xacro, SDF or MJCF: drop the robot's folder, or its .urdf with its meshes.");
  // The topmost ones: tests and examples are in folders farther down. A folder `urdf` counts as its parent.
  const level = (path: string) => path.split("/").length - (nameOf(parent(path)) === "urdf" ? 1 : 0);
  const highest = Math.min(...urdfs.map(level));
  const meant = urdfs.filter((path) => level(path) === highest);
  if (meant.length > MAX_URDFS) {
    const names = meant.slice(0, MAX_URDFS).map(nameOf).join(", ");
    throw new Error(`There are ${meant.length} descriptions (${names}, ...): drop a folder that holds only the one to load.`);
  }
  return meant;
}
