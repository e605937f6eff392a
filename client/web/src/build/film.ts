// A video of the picture, as WebM: of what happens, or of a paused world by steps, in which a second of the video is a second of the world.
import { signal } from "@preact/signals";
import { stepAndSee } from "../daemon/stepping";
import { save } from "../state/download";
import { drawnSequence, redraws } from "../state/picture";
import { toast } from "../state/toasts";
import { daemonName, physics, simulation } from "../state/world";

/** Pictures a second, at most: as many as are drawn. */
const RATE = 60;
/** Of a video of steps: milliseconds that each picture is shown. */
const SHOWN = 1000 / 30;
/** Bytes of a video that are kept: then it ends by itself. */
const MOST = 512 << 20;
const TYPES: readonly string[] = ["video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm"];

/** Whether one is being taken. */
export const filming = signal(false);

let recorder: MediaRecorder | null = null;

/** Begins a video of what the view shows, or ends it and saves it on this machine. */
export function toggleFilm(): void {
  if (recorder) recorder.stop();
  else begin();
}

/** Begins a video of a paused world: it is stepped for each picture, until the video is ended or somebody lets the world play. */
export async function filmSteps(): Promise<void> {
  const made = recorder ? null : begin();
  if (!made) return;
  made.pause();
  // Milliseconds of the video, and steps so far.
  let [length, steps] = [SHOWN, 0];
  const period = 1000 * (physics.peek()?.timeStep ?? 0.001);
  while (recorder === made && simulation.peek().state === "paused") {
    // As many as the video is behind, so that a slow machine does not slow the world down in it.
    const due = Math.max(1, Math.round(length / period) - steps);
    const sequence = await stepAndSee(due);
    if (sequence === undefined || made.state === "inactive") break;
    steps += due;
    await drawn(sequence);
    length += await shown(made);
  }
  if (made.state !== "inactive") made.stop();
}

/** Waits until a state is in the picture. */
function drawn(sequence: bigint): Promise<void> {
  return new Promise((resolve) => {
    let end: (() => void) | undefined;
    const look = (newest: bigint): void => {
      if (newest < sequence) return;
      resolve();
      queueMicrotask(() => end?.());
    };
    end = drawnSequence.subscribe(look);
  });
}

/** Takes one picture into the video for some time; resolves to how long that was. */
async function shown(made: MediaRecorder): Promise<number> {
  made.resume();
  const begun = performance.now();
  // What was drawn before is not in the video.
  redraws.value += 1;
  await new Promise((resolve) => setTimeout(resolve, SHOWN));
  if (made.state === "recording") made.pause();
  return performance.now() - begun;
}

function begin(): MediaRecorder | null {
  const canvas = document.querySelector<HTMLCanvasElement>(".viewport canvas");
  const type = TYPES.find((each) => "MediaRecorder" in globalThis && MediaRecorder.isTypeSupported(each));
  if (!canvas || type === undefined) {
    toast("error", "This browser cannot make a video of the picture.");
    return null;
  }
  const parts: Blob[] = [];
  let bytes = 0;
  const stream = canvas.captureStream(RATE);
  const made = new MediaRecorder(stream, { mimeType: type, videoBitsPerSecond: 8_000_000 });
  recorder = made;
  made.ondataavailable = ({ data }) => {
    parts.push(data);
    bytes += data.size;
    if (bytes > MOST && made.state !== "inactive") {
      toast("info", "The video is as large as a page can keep; it ends here.");
      made.stop();
    }
  };
  made.onerror = () => toast("error", "The browser ended the video; what there is of it is saved.");
  made.onstop = () => {
    recorder = null;
    filming.value = false;
    for (const track of stream.getTracks()) track.stop();
    if (bytes > 0) save(`${daemonName.peek() || "simd"}.webm`, new Blob(parts, { type: "video/webm" }));
    else toast("info", "Nothing was drawn while the video was taken.");
  };
  made.start(1000);
  filming.value = true;
  return made;
}
