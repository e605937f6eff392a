// Reasons why a URI has no file: the reasons of server/formats/assets, with messages for the user.

export type MissingReason =
  | "missing"
  | "empty"
  | "xacro"
  | "null"
  | "network"
  | "scheme"
  | "no_file"
  | "no_package"
  | "windows"
  | "climbs_out"
  | "absolute_outside"
  | "not_a_mesh"
  | "ambiguous";

const PHRASES: Record<MissingReason, string> = {
  missing: "names no file that was dropped",
  empty: "is empty",
  xacro: "is an unexpanded xacro expression: run `xacro` on the file first",
  null: "holds a null character",
  network: "is a network address, and nothing is fetched from the network",
  scheme: "has a scheme other than package, model and file",
  no_file: "names a package and no file in it",
  no_package: "names no package",
  windows: "is a path on a Windows disk, which other machines do not have",
  climbs_out: "climbs out of the robot's package with `..`",
  absolute_outside: "is an absolute path outside of the robot's package",
  not_a_mesh: "is not a mesh or an image by its name",
  ambiguous: "fits several files that differ only in capital letters",
};

/** There is no file for a URI. */
export interface Missing {
  why: MissingReason;
  /** The paths that were tried, in order. */
  places: string[];
}

/** For the load report, after "looked in". */
export function searchedPlaces(uri: string, { why, places }: Missing): string[] {
  const reason = why === "missing" ? `no file for \`${uri}\` was dropped` : `\`${uri}\` ${PHRASES[why]}`;
  if (places.length === 0) return [`no place, because ${reason}`];
  if (why === "missing") return places;
  return places.map((place, index) => (index === places.length - 1 ? `${place} (refused: ${reason})` : place));
}
