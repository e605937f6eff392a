// The files of what was dropped or chosen, folders with all that is in them.
import type { DroppedFile } from "../daemon/actions";

/** More files than a package of robots has: somebody dropped a whole disk. */
const MOST = 20_000;

/** All files below what was dropped. Must be called before the drop's handler returns. */
export async function droppedFiles(items: DataTransferItemList): Promise<DroppedFile[]> {
  const entries: FileSystemEntry[] = [];
  const files: DroppedFile[] = [];
  for (const item of items) {
    const entry = item.webkitGetAsEntry();
    // What is dragged out of another program may be a file that lies on no disk.
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
  const waiting = [...entries];
  for (let entry = waiting.pop(); entry; entry = waiting.pop()) {
    if (entry.isFile) {
      const file = await fileOf(entry as FileSystemFileEntry);
      files.push({ path: entry.fullPath.replace(/^\//, ""), file });
      if (files.length > MOST) throw new Error(`that is more than ${MOST} files; drop only the robot's own folder`);
    } else {
      waiting.push(...(await childrenOf(entry as FileSystemDirectoryEntry)));
    }
  }
  return files;
}

function fileOf(entry: FileSystemFileEntry): Promise<File> {
  return new Promise((resolve, reject) => entry.file(resolve, reject));
}

async function childrenOf(folder: FileSystemDirectoryEntry): Promise<FileSystemEntry[]> {
  const reader = folder.createReader();
  const children: FileSystemEntry[] = [];
  for (;;) {
    // A reader gives a hundred at a time, and nothing once all were given.
    const some = await new Promise<FileSystemEntry[]>((resolve, reject) => reader.readEntries(resolve, reject));
    if (some.length === 0) return children;
    children.push(...some);
  }
}
