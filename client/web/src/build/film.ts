// A video of the picture, as WebM.
import { signal } from "@preact/signals";
import { save } from "../state/download";
import { toast } from "../state/toasts";
import { daemonName } from "../state/world";

/** Pictures a second, at most: as many as are drawn. */
const RATE = 60;
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

function begin(): void {
  const canvas = document.querySelector<HTMLCanvasElement>(".viewport canvas");
  const type = TYPES.find((each) => "MediaRecorder" in globalThis && MediaRecorder.isTypeSupported(each));
  if (!canvas || type === undefined) {
    toast("error", "This browser cannot make a video of the picture.");
    return;
  }
  const parts: Blob[] = [];
  let bytes = 0;
  const stream = canvas.captureStream(RATE);
  const made = new MediaRecorder(stream, { mimeType: type, videoBitsPerSecond: 8_000_000 });
  recorder = made;
  made.ondataavailable = ({ data }) => {
    parts.push(data);
    bytes += data.size;
    if (bytes > MOST && made.state === "recording") {
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
}
