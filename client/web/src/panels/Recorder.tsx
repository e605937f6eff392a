// Starts and stops a recording, and opens the list of recordings.
import { useComputed } from "@preact/signals";
import type { JSX } from "preact";
import { oneAtATime } from "../daemon/attempt";
import { startRecording, stopRecording } from "../daemon/recordings";
import { whyNotChange } from "../state/permission";
import { beingMade, recordingSince, recordingsOpen } from "../state/recordings";
import { connection } from "../state/world";
import { bytesText, durationText } from "./amounts";
import { Icon } from "./icons";

/** Two buttons; the first shows the duration and the size of the recording. */
export function Recorder(): JSX.Element {
  const away = useComputed(() => connection.value.state !== "live").value;
  const active = beingMade.value;
  const whyNot = whyNotChange.value;
  const since = recordingSince.value;
  const time = active && since !== null ? durationText((active.modified - since) / 1000) : "";
  const what = active ? `Stop recording ${active.name}` : "Record";
  return (
    <div class="recorder" role="group" aria-label="Recordings">
      <button
        type="button"
        class={active ? "button sign recording" : "button quiet sign"}
        data-testid="record"
        aria-label={what}
        title={whyNot || `${what} (R)`}
        disabled={away || whyNot !== ""}
        onClick={() => void toggleRecording()}
      >
        <Icon name={active ? "stop" : "record"} />
        {active && (
          <span class="recording-size" data-testid="recording-size">
            {[time, bytesText(active.bytes)].filter((part) => part !== "").join(" · ")}
          </span>
        )}
      </button>
      <button
        type="button"
        class="button quiet sign"
        data-testid="recordings"
        aria-label="List of recordings"
        title="Recordings: play, save, delete"
        onClick={() => {
          recordingsOpen.value = true;
        }}
      >
        <Icon name="film" />
      </button>
    </div>
  );
}

/** Begins a recording under a new name, or ends the current one. */
export const toggleRecording = oneAtATime((): Promise<unknown> => (beingMade.peek() ? stopRecording() : startRecording()));
