// A video of a paused world by steps: a second of the video is a second of the world, however slow the page is. The browser's `MediaRecorder` stamps
// pictures with wall time. So pictures are encoded one by one with the time of the world.
import type { ReadonlySignal } from "@preact/signals";
import { CanvasSource, getFirstEncodableVideoCodec, QUALITY_HIGH } from "mediabunny";
import { stepAndSee } from "../daemon/stepping";
import { film } from "../state/film";
import { drawnPictures, drawnSequence, redraws } from "../state/picture";
import { toast } from "../state/toasts";
import { connection, physics, simulation } from "../state/world";
import { MAX_BYTES, saveFilm, sayFilmIsFull, viewCanvas } from "./film";
import { FilmFile } from "./film-file";

/** Seconds of the world between pictures, unless a step is longer. */
const INTERVAL = 1 / 30;

/** Records a film until it is ended, until a client lets the world play, or until the daemon is lost. Saves all frames so far. */
export async function filmSteps(): Promise<void> {
  const canvas = viewCanvas();
  if (!canvas || film.peek()) return;
  const stop = new AbortController();
  film.value = { end: () => stop.abort() };
  const begun = connection.peek();
  const unwatch = connection.subscribe((now) => {
    // A restarted daemon counts its states from one: the awaited state might never come.
    if (now === begun && now.state === "live") return;
    if (!stop.signal.aborted) toast("info", "The daemon was lost, and the video ends there.");
    stop.abort();
  });
  try {
    saveFilm(...(await take(canvas, stop.signal)));
  } catch (error) {
    toast("error", `There is no video: ${wordsOf(error)}`);
  } finally {
    unwatch();
    film.value = null;
  }
}

/** Returns the file, once it is stopped. Rejects if it has no picture. */
async function take(canvas: HTMLCanvasElement, stop: AbortSignal): Promise<BlobPart[]> {
  const size = { width: canvas.width, height: canvas.height };
  // Browsers offer encoders only to pages from secure origins.
  const codec = isSecureContext ? await getFirstEncodableVideoCodec(["vp9", "vp8"], size) : null;
  if (codec === null) throw new Error("this browser cannot encode one. It needs a recent browser, and https or a daemon on this machine.");
  const file = new FilmFile();
  const source = new CanvasSource(canvas, { codec, bitrate: QUALITY_HIGH, sizeChangeBehavior: "contain" });
  file.output.addVideoTrack(source, { frameRate: 1 / INTERVAL });
  await file.output.start();
  const period = physics.peek()?.timeStep ?? 0.001;
  let steps = 0;
  let pictures = 0;
  let failure: unknown;
  try {
    while (!stop.aborted && simulation.peek().state === "paused") {
      const due = Math.max(1, Math.round(((pictures + 1) * INTERVAL) / period) - steps);
      if (!(await picture(() => source.add(steps * period, due * period), stop))) break;
      pictures += 1;
      const sequence = await stepAndSee(due, stop);
      if (sequence === undefined) break;
      steps += due;
      await when(drawnSequence, (newest) => newest >= sequence, stop);
      if (file.bytes > MAX_BYTES) {
        sayFilmIsFull();
        break;
      }
    }
  } catch (error) {
    failure = error;
  }
  if (pictures === 0) {
    await file.output.cancel();
    throw failure ?? new Error("nothing was drawn.");
  }
  const { parts, problem } = await file.content();
  failure ??= problem;
  if (failure !== undefined) toast("error", `The browser ended the video. The recorded part is saved: ${wordsOf(failure)}`);
  return parts;
}

/** Draws a picture, and calls `take` while the canvas still holds it: browsers clear it once they have shown it. Resolves to whether it was drawn. */
function picture(take: () => Promise<void>, stop: AbortSignal): Promise<boolean> {
  const before = drawnPictures.peek();
  const taken = when(drawnPictures, (count) => count !== before, stop, take);
  redraws.value += 1;
  return taken;
}

/**
 * Waits until a signal has such a value, and then for the result of `then`, which runs in the task that set it. Resolves to whether it came before
 * the stop.
 */
function when<T>(source: ReadonlySignal<T>, isIt: (value: T) => boolean, stop: AbortSignal, then = (): Promise<void> => Promise.resolve()): Promise<boolean> {
  let cancel = (): void => undefined;
  const waited = new Promise<boolean>((resolve, reject) => {
    let came = false;
    let end: (() => void) | undefined;
    const look = (value: T): void => {
      if (came || !isIt(value)) return;
      came = true;
      end?.();
      try {
        then().then(() => resolve(true), reject);
      } catch (error) {
        // The code that set the signal still has work to do.
        reject(error);
      }
    };
    cancel = () => {
      end?.();
      resolve(came);
    };
    end = source.subscribe(look);
    if (came) end();
  });
  stop.addEventListener("abort", cancel);
  if (stop.aborted) cancel();
  return waited.finally(() => stop.removeEventListener("abort", cancel));
}

function wordsOf(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}
