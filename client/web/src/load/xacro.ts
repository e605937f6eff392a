// Xacro among dropped files: their arguments, and their expansion by the daemon.
import type { Services } from "../daemon/services";
import { checkSize } from "./limits";
import { MOUNT, nameOf } from "./tree";

/** Files that a xacro file may include or read, and manifests, which give folders their package names. */
const SOURCES = /\.(xacro|urdf|xml|gazebo|ya?ml)$/i;
/** Bytes: no person writes a larger source, and the daemon reads none. */
const MAX_BYTES = 4 << 20;

/** A file that is to be loaded. */
export interface Chosen {
  /** Among the dropped files. */
  path: string;
  /** Values of a xacro's `$(arg NAME)` by name. */
  values: Readonly<Record<string, string>>;
}

/** An argument that a file declares. */
export interface XacroArgument {
  name: string;
  /** Undefined if a value is required. */
  preset: string | undefined;
}

/** Whether a file is expanded before it is loaded. */
export function isXacro(path: string): boolean {
  return /\.xacro$/i.test(path);
}

/** Returns the arguments that a file declares by `<xacro:arg>`, each name once. */
export function argumentsIn(text: string): XacroArgument[] {
  const found = new Map<string, XacroArgument>();
  for (const [, attributes = ""] of text.replace(/<!--[^]*?-->/g, "").matchAll(/<xacro:arg\s([^>]*)>/g)) {
    const value = (name: string): string | undefined => {
      const match = new RegExp(`(?:^|\\s)${name}\\s*=\\s*("[^"]*"|'[^']*')`).exec(attributes);
      return match?.[1] === undefined ? undefined : plain(match[1].slice(1, -1));
    };
    const name = value("name");
    if (name !== undefined && name !== "" && !found.has(name)) found.set(name, { name, preset: value("default") });
  }
  return [...found.values()];
}

/** Text of an attribute without its escapes. */
function plain(text: string): string {
  const signs: Record<string, string> = { "&lt;": "<", "&gt;": ">", "&quot;": '"', "&apos;": "'", "&amp;": "&" };
  return text.replace(/&(?:lt|gt|quot|apos|amp);/g, (sign) => signs[sign] ?? sign);
}

/** Returns the URDF that a dropped file expands to, and its messages by `xacro.message` and `xacro.warning`. */
export async function expandXacro(entities: Services["entities"], files: ReadonlyMap<string, File>, { path, values }: Chosen): Promise<{ urdf: Uint8Array<ArrayBuffer>; messages: string[] }> {
  const sources = [...files].filter(([name, { size }]) => SOURCES.test(name) && size <= MAX_BYTES);
  checkSize(nameOf(path), "message", sources.reduce((sum, [, { size }]) => sum + size, 0));
  const read = async ([name, file]: [string, File]) => [name.slice(1), new Uint8Array(await file.arrayBuffer())] as const;
  const { urdf, messages } = await entities.expandXacro({
    files: Object.fromEntries(await Promise.all(sources.map(read))),
    path: `${MOUNT}/${path.replace(/^\/+/, "")}`.slice(1),
    arguments: { ...values },
  });
  return { urdf: new Uint8Array(urdf), messages };
}
