// Opens a dropped zip: nothing in it is trusted, neither its sizes nor its names.
import type { DroppedFile } from "./load";

/** Limits of an archive's contents. */
export interface ZipLimits {
  /** Files and folders. */
  entries: number;
  /** Bytes of all files once they are unpacked. */
  bytes: number;
  /** Maximum ratio of a file's length to its packed length. */
  ratio: number;
}

/** More than any robot package has; a picture of one colour packs into a two hundredth. */
export const ZIP_LIMITS: ZipLimits = { entries: 20_000, bytes: 1 << 30, ratio: 250 };

/** Shorter files may have any ratio. */
const RATIO_FROM = 1 << 20;
/** A zip ends with a record of this many bytes, and a comment. */
const END_BYTES = 22;
const MAX_COMMENT = 0xffff;
const SIGNATURES = { end: 0x06054b50, central: 0x02014b50, local: 0x04034b50 } as const;
const STORED = 0;
const DEFLATED = 8;
const MEBIBYTE = 1 << 20;

interface Entry {
  path: string;
  method: number;
  packed: number;
  size: number;
  /** Offset of its local header, bytes. */
  offset: number;
}

/** Whether a file is opened rather than loaded. */
export function isZip(name: string): boolean {
  return /\.zip$/i.test(name);
}

/**
 * Returns the files in an archive, below a folder with the archive's name unless they share a folder already: packages are found by
 * folder names. Throws an error for the user. `progress` is called with the unpacked and the total number of bytes.
 */
export async function openZip(zip: File, limits = ZIP_LIMITS, progress: (done: number, total: number, item: string) => void = () => undefined): Promise<DroppedFile[]> {
  const entries = await entriesOf(zip, limits);
  const total = entries.reduce((sum, { size }) => sum + size, 0);
  if (total > limits.bytes) throw new Error(`${zip.name} would be ${mebibytes(total)} unpacked, and the limit is ${mebibytes(limits.bytes)}.`);
  const roots = new Set(entries.map(({ path }) => (path.includes("/") ? path.slice(0, path.indexOf("/")) : "")));
  const folder = roots.size === 1 && !roots.has("") ? "" : `${zip.name.replace(/\.zip$/i, "")}/`;
  const files: DroppedFile[] = [];
  let done = 0;
  for (const entry of entries) {
    progress(done, total, entry.path);
    const bytes = await unpack(zip, entry, limits);
    files.push({ path: folder + entry.path, file: new File([bytes], entry.path.slice(entry.path.lastIndexOf("/") + 1)) });
    done += entry.size;
  }
  return files;
}

/** Returns the files that an archive lists, without the metadata that systems put beside them. */
async function entriesOf(zip: File, limits: ZipLimits): Promise<Entry[]> {
  const tail = await viewOf(zip, Math.max(0, zip.size - END_BYTES - MAX_COMMENT), zip.size);
  let end = tail.byteLength - END_BYTES;
  while (end >= 0 && tail.getUint32(end, true) !== SIGNATURES.end) end -= 1;
  if (end < 0) throw new Error(`${zip.name} is not a zip file, or is cut off.`);
  const count = tail.getUint16(end + 10, true);
  const bytes = tail.getUint32(end + 12, true);
  const from = tail.getUint32(end + 16, true);
  if (count === 0xffff || from === 0xffffffff) throw new Error(`${zip.name} has zip64's records, which this page does not read: unpack it, and drop the folder.`);
  if (count > limits.entries) throw new Error(`${zip.name} has ${count} entries, and the limit is ${limits.entries}.`);
  const list = await viewOf(zip, from, from + bytes);
  const entries: Entry[] = [];
  let at = 0;
  for (let index = 0; index < count; index += 1) {
    if (at + 46 > list.byteLength || list.getUint32(at, true) !== SIGNATURES.central) throw damaged(zip);
    const lengths = [28, 30, 32].map((offset) => list.getUint16(at + offset, true));
    const [nameLength = 0] = lengths;
    const next = at + 46 + lengths.reduce((sum, length) => sum + length, 0);
    if (next > list.byteLength) throw damaged(zip);
    const flags = list.getUint16(at + 8, true);
    const path = pathOf(new Uint8Array(list.buffer, list.byteOffset + at + 46, nameLength), (flags & 0x800) !== 0);
    const entry = { path, method: list.getUint16(at + 10, true), packed: list.getUint32(at + 20, true), size: list.getUint32(at + 24, true), offset: list.getUint32(at + 42, true) };
    at = next;
    if (path === "" || path.endsWith("/") || /(^|\/)(__MACOSX|\.git)\//.test(path)) continue;
    if ((flags & 1) !== 0) throw new Error(`${path} in ${zip.name} is encrypted: unpack it, and drop the folder.`);
    entries.push(entry);
  }
  return entries;
}

/** Returns a name with slashes between folders, and without a way out of the archive; empty if nothing remains. */
function pathOf(name: Uint8Array<ArrayBuffer>, isUtf8: boolean): string {
  const text = new TextDecoder(isUtf8 || isPlain(name) ? "utf-8" : "windows-1252").decode(name).replaceAll("\\", "/");
  const steps = text.split("/").filter((step) => step !== "" && step !== "." && step !== "..");
  return steps.length === 0 ? "" : steps.join("/") + (text.endsWith("/") ? "/" : "");
}

/** Whether bytes without the mark of UTF-8 are UTF-8 nevertheless, as many programs write them. */
function isPlain(name: Uint8Array<ArrayBuffer>): boolean {
  try {
    new TextDecoder("utf-8", { fatal: true }).decode(name);
    return true;
  } catch {
    return false;
  }
}

async function unpack(zip: File, { path, method, packed, size, offset }: Entry, limits: ZipLimits): Promise<Blob> {
  if (method !== STORED && method !== DEFLATED) throw new Error(`${path} in ${zip.name} is packed in a way that browsers do not read: unpack it, and drop the folder.`);
  const tooDense = `${path} in ${zip.name} is more than ${limits.ratio} times as long as it is packed: it is not unpacked.`;
  if (size > RATIO_FROM && size > limits.ratio * packed) throw new Error(tooDense);
  const header = await viewOf(zip, offset, offset + 30);
  if (header.byteLength < 30 || header.getUint32(0, true) !== SIGNATURES.local) throw damaged(zip);
  const begin = offset + 30 + header.getUint16(26, true) + header.getUint16(28, true);
  const source = zip.slice(begin, begin + packed);
  if (source.size !== packed) throw damaged(zip);
  if (method === STORED) {
    if (packed !== size) throw damaged(zip);
    return source;
  }
  let length = 0;
  // The list may state a false length.
  const counted = new TransformStream<Uint8Array, Uint8Array<ArrayBuffer>>({
    transform(part, controller) {
      length += part.length;
      if (length > size) throw damaged(zip);
      controller.enqueue(new Uint8Array(part));
    },
  });
  let blob: Blob;
  try {
    blob = await new Response(source.stream().pipeThrough(new DecompressionStream("deflate-raw")).pipeThrough(counted)).blob();
  } catch {
    throw damaged(zip);
  }
  if (length !== size) throw damaged(zip);
  return blob;
}

async function viewOf(zip: File, from: number, to: number): Promise<DataView<ArrayBuffer>> {
  try {
    return new DataView(await zip.slice(from, to).arrayBuffer());
  } catch {
    throw new Error(`${zip.name} cannot be read: was it moved, or changed since it was dropped?`);
  }
}

function damaged(zip: File): Error {
  return new Error(`${zip.name} is damaged: unpack it, and drop the folder.`);
}

function mebibytes(bytes: number): string {
  return `${Math.round(bytes / MEBIBYTE).toLocaleString("en")} MiB`;
}
