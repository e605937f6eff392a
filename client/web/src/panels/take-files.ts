// Takes dropped or chosen files: plays recordings, opens zips, and asks for the options of robots.
import type { DroppedFile } from "../daemon/actions";
import { isRecording, playFiles } from "../daemon/recordings";
import { loading } from "../state/report";
import { toast } from "../state/toasts";
import { tool } from "../state/tools";

/** Takes files once they are found. A message reports errors. */
export async function takeFiles(finding: Promise<DroppedFile[]>): Promise<void> {
  try {
    const files = await opened(await finding);
    const recorded = files.filter(({ path }) => isRecording(path));
    if (recorded.length > 0) await playFiles(recorded.map(({ file }) => file));
    else tool.value = { kind: "load", files };
  } catch (error) {
    toast("error", `The dropped files could not be read: ${error instanceof Error ? error.message : String(error)}`);
  } finally {
    loading.value = null;
  }
}

/** Returns the files, with the contents of archives in place of the archives. */
async function opened(files: DroppedFile[]): Promise<DroppedFile[]> {
  if (!files.some(({ path }) => /\.zip$/i.test(path))) return files;
  // Most visits open none.
  const { isZip, openZip } = await import("../load/zip");
  const all: DroppedFile[] = [];
  for (const dropped of files) {
    if (!isZip(dropped.path)) all.push(dropped);
    else all.push(...(await openZip(dropped.file, undefined, (done, total, item) => (loading.value = { what: dropped.file.name, phase: "unpacking", done, total, item }))));
  }
  return all;
}
