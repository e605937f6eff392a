// From a URI that a URDF names to a dropped file: by the rules of client/assets, for a tree without links.
import { isWithin, join, nameOf, parent, steps, type Tree } from "./tree";
import { readings, type Reading } from "./uri";
import type { Missing, Why } from "./why";

/** How many folders above the URDF are looked at. */
const MAX_ANCESTORS = 8;

/** Of what a URDF may name: else a stranger's URDF would have a page send what lies beside it. */
const EXTENSIONS = new Set(
  (
    "stl obj dae ply off gltf glb bin mtl 3ds 3mf fbx wrl x3d msh usd usda usdc usdz step stp iges igs " +
    "png jpg jpeg bmp tga tif tiff gif webp dds hdr"
  ).split(" "),
);

/** Finds the files that one URDF names. */
export class Locator {
  private readonly folder: string;
  private readonly above: string[];

  /** For a URDF at this path of the tree. */
  constructor(
    private readonly tree: Tree,
    urdf: string,
  ) {
    this.folder = parent(urdf);
    this.above = ancestors(this.folder);
  }

  /** The path of the file that `uri` names. */
  find(uri: string): { path: string } | Missing {
    const wanted = readings(uri);
    if (typeof wanted === "string") return { why: wanted, places: [] };
    const search = new Search(this.tree);
    // Files in other case only where there is none as it is written.
    for (const anyCase of [false, true]) {
      search.anyCase = anyCase;
      for (const reading of wanted) {
        const path = this.look(search, reading);
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
      case "relative": {
        const home = this.home();
        return home === undefined ? undefined : search.look(this.folder, home, reading.path);
      }
    }
  }

  /** In the order of likelihood. */
  private inPackage(search: Search, name: string, rest: string): string | undefined {
    const folders: string[] = [];
    if (name !== "") {
      for (const folder of this.above) {
        if (nameOf(folder) === name || this.tree.manifestOf(folder) === name) folders.push(folder);
        folders.push(join(folder, name));
      }
    }
    // The folder of an export is often renamed, and the URDF in it is not.
    folders.push(...this.above.filter((folder) => this.looksLikePackage(folder)));
    return firstOf(folders, (folder) => search.look(folder, folder, rest));
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
    if (known.length === 0) search.passBy("absolute_outside");
    return firstOf(known, (folder) => search.look(folder, folder, wanted.slice(folder.length)));
  }

  /** The package that the URDF is part of, as far as can be told: what it may name lies in it. */
  private home(): string | undefined {
    const manifested = this.above.find((folder) => this.isPackage(folder));
    if (manifested !== undefined) return manifested;
    // No deeper than `NAME/urdf/arm/arm.urdf`: farther up, a folder of that name means little.
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

/** One search: where it looked, and why it passed by what it saw. */
class Search {
  anyCase = false;
  readonly places: string[] = [];
  why: Why | undefined;

  constructor(private readonly tree: Tree) {}

  /** The path of `folder/rest`, if it is a file to be given away and lies within `boundary`. */
  look(folder: string, boundary: string, rest: string): string | undefined {
    const candidate = joinWithin(folder, boundary, rest);
    if (candidate === undefined) {
      this.passBy("climbs_out");
      return undefined;
    }
    if (!this.places.includes(candidate)) this.places.push(candidate);
    const found = this.tree.exists(candidate) || !this.anyCase ? candidate : this.inOtherCase(boundary, candidate);
    if (found === undefined || !this.tree.isFile(found)) return undefined;
    const name = nameOf(found);
    const dot = name.lastIndexOf(".");
    if (dot <= 0 || !EXTENSIONS.has(name.slice(dot + 1).toLowerCase())) {
      this.passBy("not_a_mesh");
      return undefined;
    }
    return found;
  }

  /** The one path that differs from `wanted` in capital letters alone. */
  private inOtherCase(boundary: string, wanted: string): string | undefined {
    let at = boundary;
    for (const step of steps(wanted.slice(boundary.length))) {
      if (this.tree.exists(join(at, step))) {
        at = join(at, step);
        continue;
      }
      const alike = this.tree.namesIn(at).filter((name) => name.toLowerCase() === step.toLowerCase());
      if (alike.length > 1) this.passBy("ambiguous");
      const [only] = alike;
      if (only === undefined || alike.length > 1) return undefined;
      at = join(at, only);
    }
    return at;
  }

  /** The first reason is kept: it is of the likeliest place. */
  passBy(why: Why): void {
    this.why ??= why;
  }
}

/** Joins; nothing where a `..` climbs out of the boundary. */
function joinWithin(folder: string, boundary: string, rest: string): string | undefined {
  let joined = folder;
  for (const step of steps(rest)) {
    joined = step === ".." ? parent(joined) : join(joined, step);
    if (step === ".." && !isWithin(joined, boundary)) return undefined;
  }
  return isWithin(joined, boundary) ? joined : undefined;
}
