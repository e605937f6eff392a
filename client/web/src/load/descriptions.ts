// Descriptions of robots among dropped files: their kinds, their numbers of links, and the likeliest one.
import { nameOf, parent } from "./tree";
import type { DroppedFile } from "./load";

/** A format of descriptions. */
export type Kind = "URDF" | "SDF" | "MJCF" | "xacro";

/** A file that describes robots. */
export interface Description {
  /** Among the dropped files. */
  path: string;
  kind: Kind;
  /** Number of links in the file; undefined if it is known only after expansion, or if the file is too long to read. */
  links?: number;
}

/** Bytes: a longer file is listed only by its name. */
const MAX_BYTES = 8 << 20;
/** Maximum number of XML files that the page reads. */
const MAX_FILES = 2000;

const ENDINGS: readonly (readonly [RegExp, Kind])[] = [
  [/\.urdf$/i, "URDF"],
  [/\.(sdf|world)$/i, "SDF"],
  [/\.mjcf$/i, "MJCF"],
  [/\.xacro$/i, "xacro"],
];

/** Kind of an XML file by its first element. */
const ROOTS: Readonly<Record<string, Kind>> = { robot: "URDF", sdf: "SDF", mujoco: "MJCF" };

/** Elements that are counted. */
const LINKS: Readonly<Record<Exclude<Kind, "xacro">, RegExp>> = { URDF: /<link[\s>/]/g, SDF: /<link[\s>/]/g, MJCF: /<body[\s>/]/g };

/** The descriptions among files, the likeliest first. */
export async function findDescriptions(files: readonly DroppedFile[]): Promise<Description[]> {
  const found: Description[] = [];
  let looked = 0;
  for (const { path, file } of files) {
    const named = ENDINGS.find(([ending]) => ending.test(path))?.[1];
    const isXml = /\.xml$/i.test(path);
    if (!named && !isXml) continue;
    if (named === "xacro" || file.size > MAX_BYTES || looked >= MAX_FILES) {
      if (named) found.push({ path, kind: named });
      continue;
    }
    looked += 1;
    const text = withoutComments(await file.text().catch(() => ""));
    const kind = named ?? ROOTS[rootOf(text)];
    if (kind && kind !== "xacro") found.push({ path, kind, links: text.match(LINKS[kind])?.length ?? 0 });
  }
  return found.toSorted((a, b) => rank(a) - rank(b) || level(a.path) - level(b.path) || (a.path < b.path ? -1 : 1));
}

/** The name of the first element. */
function rootOf(text: string): string {
  return /<([A-Za-z_][\w:.-]*)/.exec(text)?.[1] ?? "";
}

function withoutComments(text: string): string {
  return text.replace(/<!--[^]*?-->/g, "").replace(/<\?[^]*?\?>/g, "").replace(/<!DOCTYPE[^>]*>/gi, "");
}

/** Complete descriptions come before xacro, and XML after it, since packages have XML for other purposes too. */
function rank({ path, kind }: Description): number {
  if (/\.xml$/i.test(path)) return 5;
  if (kind === "xacro") return /\.urdf\.xacro$/i.test(path) ? 3 : 4;
  return ["URDF", "SDF", "MJCF"].indexOf(kind);
}

/** Tests and examples are in folders farther down. A folder `urdf` counts as its parent. */
function level(path: string): number {
  return path.split("/").length - (nameOf(parent(path)) === "urdf" ? 1 : 0);
}

/** Returns the name of a file in a list, with its folders if another file has the same name. */
export function shownPath(path: string, paths: readonly string[]): string {
  const alike = paths.filter((other) => nameOf(other) === nameOf(path));
  return alike.length > 1 ? path : nameOf(path);
}
