// Resolves the URIs of a URDF to dropped files: by the rules of server/formats/assets, for a tree without symbolic links.
import { isWithin, join, nameOf, parent, steps, type Tree } from "./tree";
import { readings, type Reading } from "./uri";
import type { Missing, MissingReason } from "./missing-file";

/** Maximum number of folders above the URDF that are searched. */
const MAX_ANCESTORS = 8;

/** Extensions that a URDF may refer to: an untrusted URDF must not make the page upload other files beside it. */
const EXTENSIONS = new Set(
  (
    "stl obj dae ply off gltf glb bin mtl 3ds 3mf fbx wrl x3d msh usd usda usdc usdz step stp iges igs " +
    "png jpg jpeg bmp tga tif tiff gif webp dds hdr"
  ).split(" "),
);

/** Extensions of files that an SDF or MJCF may include: such text becomes a part of a robot that is uploaded. */
const DESCRIPTIONS = ["sdf", "world", "xml", "mjcf", "config"];

/** Whether a file is, by its name, an SDF or MJCF, which may include others. */
export function includes(description: string): boolean {
  return DESCRIPTIONS.includes(extensionOf(description) ?? "");
}

/** Whether a file, by its name, may refer to files of its appearance. */
export function mayNameMore(path: string): boolean {
  return ["obj", "mtl", "dae", "gltf", "glb"].includes(extensionOf(path) ?? "");
}

function extensionOf(path: string): string | undefined {
  const name = nameOf(path);
  const dot = name.lastIndexOf(".");
  return dot <= 0 ? undefined : name.slice(dot + 1).toLowerCase();
}

/** Finds the files that one URDF refers to. */
export class Locator {
  private readonly folder: string;
  private readonly above: string[];
  private readonly extensions: ReadonlySet<string>;

  /** For a URDF at this path of the tree. */
  constructor(
    private readonly tree: Tree,
    urdf: string,
  ) {
    this.folder = parent(urdf);
    this.above = ancestors(this.folder);
    this.extensions = includes(urdf) ? new Set([...EXTENSIONS, ...DESCRIPTIONS, "urdf"]) : EXTENSIONS;
  }

  /** The path of the file of `uri`. */
  find(uri: string): { path: string } | Missing {
    const wanted = readings(uri);
    if (typeof wanted === "string") return { why: wanted, places: [] };
    const search = new Search(this.tree, this.extensions);
    // Other spellings in case are tried only if there is no exact match.
    for (const anyCase of [false, true]) {
      search.anyCase = anyCase;
      for (const reading of wanted) {
        const path = this.look(search, reading) ?? this.inRoots(search, reading);
        if (path !== undefined) return { path };
      }
    }
    return { why: search.why ?? "missing", places: search.places };
  }

  private look(search: Search, reading: Reading): string | undefined {
    switch (reading.kind) {
      case "package":
        return this.inPackage(search, reading.name, reading.rest);
      case "absolute":
        return this.absolute(search, reading.path);
      case "relative":
        // Any dropped file.
        return search.look(this.folder, "/", reading.path);
    }
  }

  /** The likeliest folder first. */
  private inPackage(search: Search, name: string, rest: string): string | undefined {
    const folders: string[] = [];
    if (name !== "") {
      for (const folder of this.above) {
        if (nameOf(folder) === name || this.tree.manifestOf(folder) === name) folders.push(folder);
        folders.push(join(folder, name));
        // Folder of models beside the one of worlds: `models/NAME` for `worlds/w.sdf`.
        folders.push(join(join(folder, "models"), name));
      }
    }
    // The folder of an export is often renamed without its URDF.
    folders.push(...this.above.filter((folder) => this.looksLikePackage(folder)));
    return firstOf(folders, (folder) => search.look(folder, folder, rest));
  }

  /** Exports name files from the folder of their package, even if the URDF lies deeper. */
  private inRoots(search: Search, reading: Reading): string | undefined {
    if (reading.kind === "absolute" || (reading.kind === "package" && reading.name !== "")) return undefined;
    const rest = reading.kind === "package" ? reading.rest : reading.path;
    const folders = this.above.filter((folder) => this.looksLikePackage(folder));
    const home = this.home();
    if (home !== undefined && !folders.includes(home)) folders.push(home);
    // A path that leaves a package does not start at its folder.
    const within = folders.filter((folder) => joinWithin(folder, folder, rest) !== undefined);
    return firstOf(within, (folder) => search.look(folder, folder, rest));
  }

  private absolute(search: Search, path: string): string | undefined {
    const wanted = `/${steps(path).join("/")}`;
    const home = this.home();
    const folders = home === undefined ? [] : [home];
    for (const folder of this.above) {
      const [first] = isWithin(wanted, folder) ? steps(wanted.slice(folder.length)) : [];
      if (first !== undefined && this.isPackage(join(folder, first))) folders.push(join(folder, first));
    }
    const known = folders.filter((folder) => isWithin(wanted, folder));
    if (known.length === 0) search.reject("absolute_outside");
    return firstOf(known, (folder) => search.look(folder, folder, wanted.slice(folder.length)));
  }

  /** The package that the URDF is presumably part of: absolute URIs must stay in it. */
  private home(): string | undefined {
    const manifested = this.above.find((folder) => this.isPackage(folder));
    if (manifested !== undefined) return manifested;
    // No deeper than `NAME/urdf/arm/arm.urdf`: farther up, such a name is not evidence of a package.
    const named = this.above.slice(0, 2).find((folder) => ["urdf", "robots", "robot"].includes(nameOf(folder)));
    return named === undefined ? this.above[0] : parent(named);
  }

  private isPackage(folder: string): boolean {
    return this.tree.isFile(join(folder, "package.xml"));
  }

  private looksLikePackage(folder: string): boolean {
    return this.isPackage(folder) || this.tree.isFolder(join(folder, "urdf"));
  }
}

/** The folder and those above it, nearest first, without the root. */
function ancestors(folder: string): string[] {
  const found: string[] = [];
  for (let at = folder; at !== "/" && found.length < MAX_ANCESTORS; at = parent(at)) found.push(at);
  return found;
}

function firstOf(folders: string[], look: (folder: string) => string | undefined): string | undefined {
  for (const folder of folders) {
    const found = look(folder);
    if (found !== undefined) return found;
  }
  return undefined;
}

/** One search: the paths that it tried, and why it rejected files. */
class Search {
  anyCase = false;
  readonly places: string[] = [];
  why: MissingReason | undefined;

  constructor(
    private readonly tree: Tree,
    private readonly extensions: ReadonlySet<string>,
  ) {}

  /** The path of `folder/rest`, if it is a file that may be uploaded and is within `boundary`. */
  look(folder: string, boundary: string, rest: string): string | undefined {
    const candidate = joinWithin(folder, boundary, rest);
    if (candidate === undefined) {
      this.reject("climbs_out");
      return undefined;
    }
    if (!this.places.includes(candidate)) this.places.push(candidate);
    const found = this.tree.exists(candidate) || !this.anyCase ? candidate : this.inOtherCase(boundary, candidate);
    if (found === undefined || !this.tree.isFile(found)) return undefined;
    if (!this.extensions.has(extensionOf(found) ?? "")) {
      this.reject("not_a_mesh");
      return undefined;
    }
    return found;
  }

  /** The only path that differs from `wanted` only in case. */
  private inOtherCase(boundary: string, wanted: string): string | undefined {
    let at = boundary;
    for (const step of steps(wanted.slice(boundary.length))) {
      if (this.tree.exists(join(at, step))) {
        at = join(at, step);
        continue;
      }
      const alike = this.tree.namesIn(at).filter((name) => name.toLowerCase() === step.toLowerCase());
      if (alike.length > 1) this.reject("ambiguous");
      const [only] = alike;
      if (only === undefined || alike.length > 1) return undefined;
      at = join(at, only);
    }
    return at;
  }

  /** The first reason is kept, which belongs to the likeliest path. */
  reject(why: MissingReason): void {
    this.why ??= why;
  }
}

/** Joins the paths; undefined if a `..` leaves the boundary. */
function joinWithin(folder: string, boundary: string, rest: string): string | undefined {
  let joined = folder;
  for (const step of steps(rest)) {
    joined = step === ".." ? parent(joined) : join(joined, step);
    if (step === ".." && !isWithin(joined, boundary)) return undefined;
  }
  return isWithin(joined, boundary) ? joined : undefined;
}
