// The files that were dropped or chosen, including those in folders.
import type { DroppedFile } from "../daemon/actions";
import { loading } from "../state/report";

/** Maximum number of files: a robot package has fewer, and a whole disk has more. */
const MAX_FILES = 20_000;
/** Number of files that the browser reads at one time. */
const AT_ONCE = 64;

/** All files that were dropped. Must be called before the handler of the event returns. */
export async function droppedFiles(items: DataTransferItemList): Promise<DroppedFile[]> {
  const entries: FileSystemEntry[] = [];
  const files: DroppedFile[] = [];
  for (const item of items) {
    const entry = item.webkitGetAsEntry();
    // A file that is dragged out of another program may have no entry.
    const file = entry ? null : item.getAsFile();
    if (entry) entries.push(entry);
    if (file) files.push({ path: file.name, file });
  }
  return [...files, ...(await filesBelow(entries))];
}

/** The files of a folder that was chosen in a dialog. */
export function chosenFiles(list: FileList): DroppedFile[] {
  return [...list].map((file) => ({ path: file.webkitRelativePath || file.name, file }));
}

async function filesBelow(entries: FileSystemEntry[]): Promise<DroppedFile[]> {
  const files: DroppedFile[] = [];
  let waiting = [...entries];
  const what = entries.length === 1 ? (entries[0]?.name ?? "") : "The dropped files";
  while (waiting.length > 0) {
    const some = waiting.splice(-AT_ONCE);
    loading.value = { what, phase: "looking for files", done: 0, total: 0, item: `${files.length} files so far; ${some[0]?.fullPath.slice(1) ?? ""}` };
    const found = await Promise.all(some.map(below));
    files.push(...found.flatMap((each) => ("file" in each ? [each] : [])));
    if (files.length > MAX_FILES) throw new Error(`that is more than ${MAX_FILES} files; drop only the robot's own folder.`);
    waiting = [...waiting, ...found.flatMap((each) => ("inside" in each ? each.inside : []))];
  }
  return files;
}

/** Returns a file, or the files of a folder. */
async function below(entry: FileSystemEntry): Promise<DroppedFile | { inside: FileSystemEntry[] }> {
  if (!entry.isFile) return { inside: await childrenOf(entry as FileSystemDirectoryEntry) };
  return { path: entry.fullPath.replace(/^\//, ""), file: await fileOf(entry as FileSystemFileEntry) };
}

function fileOf(entry: FileSystemFileEntry): Promise<File> {
  return new Promise((resolve, reject) => entry.file(resolve, reject));
}

async function childrenOf(folder: FileSystemDirectoryEntry): Promise<FileSystemEntry[]> {
  const reader = folder.createReader();
  const children: FileSystemEntry[] = [];
  for (;;) {
    // A reader returns up to a hundred entries at a time, and none at the end.
    const some = await new Promise<FileSystemEntry[]>((resolve, reject) => reader.readEntries(resolve, reject));
    if (some.length === 0) return children;
    children.push(...some);
  }
}
