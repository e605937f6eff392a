// Saved states of the world: listed, made, restored, and as files. Errors are shown as toasts.
import { attempt } from "./attempt";
import { MAX_FILE, type SavedState } from "../state/saved-states";
import { sha256 } from "../load/sha256";
import { uploadFile } from "../load/upload";
import { save } from "../state/download";
import { toast } from "../state/toasts";
import { daemonConnection } from "./page";
import { services } from "./services";

/** Bytes of one request. */
const PART = 1 << 20;

/** Returns all of them, the newest first. Rejects with the daemon's error. */
export async function listSavedStates(): Promise<SavedState[]> {
  const { savedStates } = await services().simulation.listSavedStates({});
  return savedStates.map(({ name, stamp, robots, owner }) => ({ name, simTime: stamp?.simTime ?? 0, robots, owner })).toReversed();
}

/** Saves the present state under a name; without one the daemon chooses it. Resolves to whether it is saved. */
export function saveState(name: string): Promise<boolean> {
  return attempt(async () => {
    const { savedState } = await services().simulation.saveState({ name });
    toast("info", `The world is saved as ${savedState?.name ?? name}.`);
  });
}

/** Restores the world to a state. */
export function restoreState(name: string): Promise<boolean> {
  return attempt(async () => {
    await services().simulation.restoreState({ name });
    daemonConnection().pollAllNow();
  });
}

export function deleteState(name: string): Promise<boolean> {
  return attempt(() => services().simulation.deleteSavedState({ name }));
}

/** Saves a state as a file on this machine. */
export function downloadState(name: string): Promise<boolean> {
  return attempt(async () => {
    const { sha256: hash, totalBytes } = await services().simulation.exportSavedState({ name });
    const total = Number(totalBytes);
    if (total > MAX_FILE) throw new Error(`${name} is too large for a browser: simctl state export ${name} saves it.`);
    const parts: Uint8Array<ArrayBuffer>[] = [];
    for (let at = 0; at < total; ) {
      const { data } = await services().entities.getAsset({ sha256: hash, offset: BigInt(at), maxBytes: BigInt(PART) });
      if (data.length === 0) throw new Error("The daemon ended the file before its end; save it again.");
      parts.push(new Uint8Array(data));
      at += data.length;
    }
    save(`${name}.simdstate`, new Blob(parts, { type: "application/octet-stream" }));
  });
}

/** Loads a saved state from a file of this machine; the world stays unchanged. */
export function uploadState(file: File): Promise<boolean> {
  return attempt(async () => {
    const bytes = new Uint8Array(await file.arrayBuffer());
    const hash = await sha256(bytes);
    await uploadFile(services().entities, hash, bytes);
    const { savedState } = await services().simulation.importSavedState({ sha256: hash });
    toast("info", `${savedState?.name ?? file.name} is loaded; put it back to return to it.`);
  });
}
