// The daemon's recordings: made, listed, saved to this machine, deleted and shown. Errors are shown as toasts.
import { attempt } from "./attempt";
import { timestampMs } from "@bufbuild/protobuf/wkt";
import { RecordingState, type Recording } from "../gen/simd/v1/recording_pb";
import { daemonSource, fileSource, type Source } from "../recording/source";
import { beingMade, recordings, recordingsOpen, type RecordingInfo } from "../state/recordings";
import { toast } from "../state/toasts";
import { messageOf } from "./error-message";
import { services, type Services } from "./services";

/** Maximum bytes that a browser holds while it saves them. */
const MAX_SAVED = 1 << 30;
/** Bytes of one request. */
const PART = 1 << 20;

const STATES: Record<RecordingState, RecordingInfo["state"]> = {
  [RecordingState.UNSPECIFIED]: "unfinished",
  [RecordingState.RECORDING]: "recording",
  [RecordingState.COMPLETE]: "complete",
  [RecordingState.UNFINISHED]: "unfinished",
};

export function recordingOf({ name, state, bytes, files, modified }: Recording): RecordingInfo {
  return {
    name,
    state: STATES[state] ?? "unfinished",
    bytes: Number(bytes),
    files: files.map((file) => ({ name: file.name, bytes: Number(file.bytes) })),
    modified: modified ? timestampMs(modified) : 0,
  };
}

/** Numbers of the last request for the list, and of the one whose answer is shown. */
let asked = 0;
let shown = 0;

/** Fetches the list again. An answer to an earlier request than the shown one is older, and is not shown. */
export async function refreshRecordings(from: Pick<Services, "recordings"> = services()): Promise<void> {
  asked += 1;
  const own = asked;
  const { recordings: list } = await from.recordings.listRecordings({}, { timeoutMs: 5000 });
  if (own < shown) return;
  shown = own;
  recordings.value = list.map(recordingOf);
}

/** Begins a recording; without a name it is named by the time. Resolves to whether it began. */
export function startRecording(name = ""): Promise<boolean> {
  return attempt(async () => {
    await services().recordings.startRecording({ name });
    await refreshRecordings();
  });
}

/** Ends the current recording. */
export async function stopRecording(): Promise<void> {
  const name = beingMade.peek()?.name ?? "";
  const stopped = await attempt(async () => {
    await services().recordings.stopRecording({ name });
    await refreshRecordings();
  });
  if (stopped) toast("info", `${name} is recorded. It is in the list of recordings, to be played or saved.`);
}

export async function deleteRecording(name: string): Promise<void> {
  await attempt(async () => {
    await services().recordings.deleteRecording({ name });
    await refreshRecordings();
  });
}

/** Contents of a recording. */
export interface RecordingContents {
  /** Time from its first to its last message, wall seconds. */
  duration: number;
  topics: { topic: string; schema: string; messages: number }[];
}

/** Reads the contents of a recording, which takes long for a large one. Undefined if they cannot be read. */
export async function recordingContents(name: string): Promise<RecordingContents | undefined> {
  let contents: RecordingContents | undefined;
  await attempt(async () => {
    const { duration, topics } = await services().recordings.getRecording({ name });
    contents = { duration, topics: topics.map(({ topic, schema, messages }) => ({ topic, schema, messages: Number(messages) })) };
  });
  return contents;
}

/** Saves the files of a recording on this machine. */
export async function downloadRecording({ name, files, bytes }: RecordingInfo): Promise<void> {
  if (bytes > MAX_SAVED) {
    toast("error", `${name} is too large for a browser: simctl record download ${name} saves it.`);
    return;
  }
  await attempt(async () => {
    for (const file of files) {
      const source = daemonSource(services().recordings, name, file.name, file.bytes);
      const parts: Uint8Array<ArrayBuffer>[] = [];
      for (let at = 0; at < source.size; at += PART) parts.push(new Uint8Array(await source.read(at, Math.min(PART, source.size - at))));
      const address = URL.createObjectURL(new Blob(parts, { type: "application/octet-stream" }));
      const link = document.createElement("a");
      link.href = address;
      link.download = file.name;
      link.click();
      // Frees the bytes once the download has started.
      setTimeout(() => URL.revokeObjectURL(address), 10_000);
    }
  });
}

/** Plays a recording of the daemon. */
export function playRecording({ name, files }: RecordingInfo): Promise<void> {
  return show(name, files.map((file) => daemonSource(services().recordings, name, file.name, file.bytes)), true);
}

/** Whether a file is shown rather than loaded. */
export function isRecording(name: string): boolean {
  return /\.mcap$/i.test(name);
}

/** Shows files of one recording, in the order of their names. */
export function playFiles(files: readonly File[]): Promise<void> {
  const sorted = files.toSorted((a, b) => (a.name < b.name ? -1 : 1));
  return show(sorted[0]?.name ?? "", sorted.map(fileSource));
}

async function show(name: string, sources: readonly Source[], plays = false): Promise<void> {
  try {
    // Most visits play nothing.
    const module = await import("../playback");
    await module.open(name, sources, module, plays);
    recordingsOpen.value = false;
  } catch (error) {
    toast("error", `${name} cannot be shown: ${messageOf(error).replace(/^[A-Z](?=[a-z]* )/, (letter) => letter.toLowerCase())}`);
  }
}
