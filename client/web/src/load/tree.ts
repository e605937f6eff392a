// Dropped files as a tree of folders, with the names of packages from their manifests.

/** Root of dropped files, since a page does not learn the path of their folder. */
export const MOUNT = "/dropped";

/** A tree whose paths are all absolute. */
export class Tree {
  private readonly files = new Set<string>();
  private readonly children = new Map<string, Set<string>>([["/", new Set()]]);
  private readonly manifests = new Map<string, string>();

  /** `paths` are below `MOUNT`; `manifests` has the text of each `package.xml` by its path. */
  constructor(paths: Iterable<string>, manifests: ReadonlyMap<string, string>) {
    for (const path of paths) this.add(path);
    for (const [path, text] of manifests) {
      const name = manifestName(text);
      if (name !== undefined) this.manifests.set(parent(path), name);
    }
  }

  private add(path: string): void {
    this.files.add(path);
    for (let at = path; at !== "/"; at = parent(at)) {
      const folder = parent(at);
      const inside = this.children.get(folder) ?? new Set();
      inside.add(at.slice(at.lastIndexOf("/") + 1));
      this.children.set(folder, inside);
    }
  }

  isFile(path: string): boolean {
    return this.files.has(path);
  }

  isFolder(path: string): boolean {
    return this.children.has(path);
  }

  exists(path: string): boolean {
    return this.isFile(path) || this.isFolder(path);
  }

  namesIn(folder: string): string[] {
    return [...(this.children.get(folder) ?? [])];
  }

  /** `<name>` of the folder's `package.xml`. */
  manifestOf(folder: string): string | undefined {
    return this.manifests.get(folder);
  }
}

/** `<name>` in the text of a manifest. */
function manifestName(text: string): string | undefined {
  return /<name>([^]*?)<\/name>/.exec(text)?.[1]?.trim();
}

export function parent(path: string): string {
  return path.slice(0, path.lastIndexOf("/")) || "/";
}

export function nameOf(path: string): string {
  return path.slice(path.lastIndexOf("/") + 1);
}

/** The components of a path, without `.` and empty ones. */
export function steps(path: string): string[] {
  return path.split("/").filter((step) => step !== "" && step !== ".");
}

export function isWithin(path: string, folder: string): boolean {
  return path === folder || path.startsWith(folder === "/" ? "/" : `${folder}/`);
}

export function join(folder: string, step: string): string {
  return folder === "/" ? `/${step}` : `${folder}/${step}`;
}
