// A video of a paused world by steps: a second of the video is a second of the world, however slow the page is.
// The browser's `MediaRecorder` stamps pictures with the clock on the wall, so pictures are encoded one by one with the time of the world.
import { BufferTarget, CanvasSource, getFirstEncodableVideoCodec, Output, QUALITY_HIGH, WebMOutputFormat } from "mediabunny";
import { messageOf } from "../daemon/error-message";
import { stepAndSee } from "../daemon/stepping";
import { drawnPictures, drawnSequence, redraws } from "../state/picture";
import { toast } from "../state/toasts";
import { physics, simulation } from "../state/world";
import { film, MAX_BYTES, saveFilm, sayFilmIsFull, viewCanvas } from "./film";

/** Seconds of the world between pictures, where a step is not longer. */
const INTERVAL = 1 / 30;

/** Takes one until it is ended, or until somebody lets the world play. */
export async function filmSteps(): Promise<void> {
  const canvas = viewCanvas();
  if (!canvas || film.peek()) return;
  let ended = false;
  film.value = { end: () => (ended = true) };
  try {
    const taken = await take(canvas, () => ended);
    if (taken) saveFilm(taken);
  } catch (error) {
    toast("error", `The video ended: ${messageOf(error)}`);
  } finally {
    film.value = null;
  }
}

/** The file, once `isEnded` says so. */
async function take(canvas: HTMLCanvasElement, isEnded: () => boolean): Promise<ArrayBuffer | null> {
  const size = { width: canvas.width, height: canvas.height };
  // Browsers give encoders only to pages that nobody can have changed on their way.
  const codec = isSecureContext ? await getFirstEncodableVideoCodec(["vp9", "vp8"], size) : null;
  if (codec === null) {
    toast("error", "This browser encodes no video here. It needs a recent browser, and https or a daemon on this machine.");
    return null;
  }
  const target = new BufferTarget();
  let bytes = 0;
  target.onwrite = (_, end) => (bytes = Math.max(bytes, end));
  const output = new Output({ format: new WebMOutputFormat(), target });
  const source = new CanvasSource(canvas, { codec, bitrate: QUALITY_HIGH, sizeChangeBehavior: "contain" });
  output.addVideoTrack(source, { frameRate: 1 / INTERVAL });
  await output.start();
  const period = physics.peek()?.timeStep ?? 0.001;
  let steps = 0;
  for (let pictures = 1; !isEnded() && simulation.peek().state === "paused"; pictures += 1) {
    const due = Math.max(1, Math.round((pictures * INTERVAL) / period) - steps);
    await picture(() => source.add(steps * period, due * period));
    const sequence = await stepAndSee(due);
    if (sequence === undefined) break;
    steps += due;
    await drawn(sequence);
    if (bytes > MAX_BYTES) {
      sayFilmIsFull();
      break;
    }
  }
  await output.finalize();
  return target.buffer;
}

/** Waits until a state is drawn. */
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

/** Draws a picture, and calls `take` while the canvas still holds it: browsers empty it once they have shown it. */
function picture(take: () => Promise<void>): Promise<void> {
  const before = drawnPictures.peek();
  return new Promise((resolve, reject) => {
    let end: (() => void) | undefined;
    const look = (count: number): void => {
      if (count === before) return;
      take().then(resolve, reject);
      queueMicrotask(() => end?.());
    };
    end = drawnPictures.subscribe(look);
    redraws.value += 1;
  });
}
