// What is in the folders that people drop or choose.
import type { DroppedFile } from "./load";

/** More files than any robot has: somebody dropped a disk. */
const MOST_FILES = 5000;

/** All files of a drop. Must be called while the event is handled: later the browser has forgotten it. */
export async function droppedFiles(transfer: DataTransfer): Promise<DroppedFile[]> {
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry());
  const found: DroppedFile[] = [];
  for (const entry of entries) {
    if (entry) await walk(entry, "", found);
  }
  return found;
}

/** The files of a file input, with `webkitdirectory` or without. */
export function chosenFiles(input: HTMLInputElement): DroppedFile[] {
  const files = [...(input.files ?? [])];
  return files.map((file) => ({ path: file.webkitRelativePath || file.name, file }));
}

async function walk(entry: FileSystemEntry, folder: string, found: DroppedFile[]): Promise<void> {
  const path = folder === "" ? entry.name : `${folder}/${entry.name}`;
  if (entry.isFile) {
    if (found.length >= MOST_FILES) throw new Error(`More than ${MOST_FILES} files were dropped: drop the robot's folder alone.`);
    found.push({ path, file: await fileOf(entry as FileSystemFileEntry) });
  } else if (!entry.name.startsWith(".") && entry.name !== "node_modules") {
    for (const inner of await entriesOf(entry as FileSystemDirectoryEntry)) await walk(inner, path, found);
  }
}

function fileOf(entry: FileSystemFileEntry): Promise<File> {
  return new Promise((resolve, reject) => entry.file(resolve, reject));
}

/** Browsers give them in portions of a hundred, until a portion is empty. */
async function entriesOf(folder: FileSystemDirectoryEntry): Promise<FileSystemEntry[]> {
  const reader = folder.createReader();
  const all: FileSystemEntry[] = [];
  for (;;) {
    const portion = await new Promise<FileSystemEntry[]>((resolve, reject) => reader.readEntries(resolve, reject));
    if (portion.length === 0) return all;
    all.push(...portion);
  }
}
