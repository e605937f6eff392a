// A video of the picture, as WebM: of events as they are drawn, or of a paused world by steps.
import { save } from "../state/download";
import { film } from "../state/film";
import { toast } from "../state/toasts";
import { daemonName } from "../state/world";

/** Maximum number of pictures a second: as many as are drawn. */
const RATE = 60;
/** Maximum size of a video, bytes. The film ends when it is reached. */
export const MAX_BYTES = 512 << 20;
const TYPES: readonly string[] = ["video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm"];

// A reload would lose it.
const ask = (event: Event): void => event.preventDefault();
film.subscribe((running) => {
  if (running) addEventListener("beforeunload", ask);
  else removeEventListener("beforeunload", ask);
});

/** The canvas of the view. */
export function viewCanvas(): HTMLCanvasElement | null {
  return document.querySelector<HTMLCanvasElement>(".viewport canvas");
}

/** Offers a video to the browser as a download. */
export function saveFilm(...parts: BlobPart[]): void {
  save(`${daemonName.peek() || "simd"}.webm`, new Blob(parts, { type: "video/webm" }));
}

export function sayFilmIsFull(): void {
  toast("info", "The video is as large as a page can keep; it ends here.");
}

/** Begins a video of the view, or ends the current one and saves it on this machine. */
export function toggleFilm(): void {
  const running = film.peek();
  if (running) running.end();
  else begin();
}

/** Begins a video of a paused world. Each picture steps it, until the video is ended or a client lets the world play. */
export async function beginFilmOfSteps(): Promise<void> {
  const loaded = await import("./film-steps").catch(() => undefined);
  if (loaded) await loaded.filmSteps();
  else toast("error", "The video encoder could not be loaded from the daemon; try again once it answers.");
}

function begin(): void {
  const canvas = viewCanvas();
  const type = TYPES.find((each) => "MediaRecorder" in globalThis && MediaRecorder.isTypeSupported(each));
  if (!canvas || type === undefined) {
    toast("error", "This browser cannot make a video of the picture.");
    return;
  }
  const parts: Blob[] = [];
  let bytes = 0;
  const stream = canvas.captureStream(RATE);
  const recorder = new MediaRecorder(stream, { mimeType: type, videoBitsPerSecond: 8_000_000 });
  const end = (): void => {
    if (recorder.state !== "inactive") recorder.stop();
  };
  recorder.ondataavailable = ({ data }) => {
    parts.push(data);
    bytes += data.size;
    if (bytes > MAX_BYTES && recorder.state !== "inactive") {
      sayFilmIsFull();
      end();
    }
  };
  recorder.onerror = () => toast("error", "The browser ended the video. The recorded part is saved.");
  recorder.onstop = () => {
    film.value = null;
    for (const track of stream.getTracks()) track.stop();
    if (bytes > 0) saveFilm(...parts);
    else toast("info", "Nothing was drawn while the video was taken.");
  };
  recorder.start(1000);
  film.value = { end };
}
