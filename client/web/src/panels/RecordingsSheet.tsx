// List of the daemon's recordings: each can be played, saved and deleted, and shows its contents.
import { signal } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import { messageOf } from "../daemon/error-message";
import { deleteRecording, downloadRecording, playFiles, playRecording, recordingContents, refreshRecordings, startRecording, type RecordingContents } from "../daemon/recordings";
import { beingMade, recordings, recordingsOpen, type RecordingInfo } from "../state/recordings";
import { whyNotChange } from "../state/permission";
import { role } from "../state/world";
import { bytesText, durationText } from "./amounts";
import { Icon } from "./icons";
import { Sheet } from "./Sheet";

/** Number of recordings until the user asks for more. */
const PAGE = 50;
/** Reason why the list cannot be fetched. */
const problem = signal("");

/** Rendered only while it is open. */
export function RecordingsSheet(): JSX.Element | null {
  if (!recordingsOpen.value) return null;
  return (
    <Sheet
      title="Recordings"
      testId="recordings-sheet"
      onClose={() => {
        recordingsOpen.value = false;
      }}
    >
      <Content />
    </Sheet>
  );
}

function Content(): JSX.Element {
  const [shown, setShown] = useState(PAGE);
  useEffect(() => {
    refreshRecordings().then(
      () => (problem.value = ""),
      (error: unknown) => (problem.value = messageOf(error)),
    );
  }, []);
  const list = (recordings.value ?? []).toSorted((a, b) => b.modified - a.modified);
  return (
    <>
      <NewRecording />
      {problem.value !== "" && <p class="refusal">{problem.value}</p>}
      {list.length === 0 ? (
        <p class="hint">No recordings yet. A recording keeps everything that happens in the world, and can be played here.</p>
      ) : (
        <ul class="recordings" data-testid="recording-list">
          {list.slice(0, shown).map((each) => (
            <Row key={each.name} recording={each} />
          ))}
        </ul>
      )}
      {list.length > shown && (
        <button type="button" class="button" onClick={() => setShown(shown + PAGE)}>
          Show more of {list.length}
        </button>
      )}
    </>
  );
}

/** Begins a recording with a name, and opens a file of this machine. */
function NewRecording(): JSX.Element {
  const name = useRef<HTMLInputElement>(null);
  const file = useRef<HTMLInputElement>(null);
  const start = async (event: Event): Promise<void> => {
    event.preventDefault();
    if (await startRecording(name.current?.value.trim() ?? "")) recordingsOpen.value = false;
  };
  return (
    <form class="new-recording" onSubmit={(event) => void start(event)}>
      <input ref={name} type="text" class="filter" aria-label="Name of a new recording" placeholder="Name (without one: the time)" data-testid="recording-name" maxLength={64} autocomplete="off" spellcheck={false} />
      <button type="submit" class="button" data-testid="record-named" title={whyNotChange.value} disabled={beingMade.value !== undefined || whyNotChange.value !== ""}>
        <Icon name="record" /> Record
      </button>
      <button type="button" class="button quiet" title="Play a recording of this machine; or drop it on the page" onClick={() => file.current?.click()}>
        <Icon name="folder" /> Open a file
      </button>
      <input
        ref={file}
        type="file"
        accept=".mcap"
        multiple
        hidden
        data-testid="recording-file"
        aria-label="File of a recording"
        onChange={(event) => {
          const { files } = event.currentTarget;
          if (files && files.length > 0) void playFiles([...files]);
          event.currentTarget.value = "";
        }}
      />
    </form>
  );
}

const STATE_WORDS = { recording: "being made", complete: "", unfinished: "not completed" } as const;

function Row({ recording }: { recording: RecordingInfo }): JSX.Element {
  const { name, state, bytes, files, modified } = recording;
  const [asks, setAsks] = useState(false);
  const mayDelete = role.value === null || role.value === "admin";
  const about = [STATE_WORDS[state], bytesText(bytes), files.length > 1 ? `${files.length} files` : "", new Date(modified).toLocaleString()];
  return (
    <li data-testid={`recording-${name}`}>
      <div class="recording-line">
        <div class="recording-name">
          <b title={name}>{name}</b>
          <span class="hint">{about.filter((part) => part !== "").join(" · ")}</span>
        </div>
        <button type="button" class="button" data-testid="play-recording" disabled={files.length === 0} onClick={() => void playRecording(recording)}>
          <Icon name="play" /> Play
        </button>
        <button type="button" class="button quiet sign" data-testid="save-recording" aria-label={`Save ${name}`} title="Save it on this machine" onClick={() => void downloadRecording(recording)}>
          <Icon name="download" />
        </button>
        <button
          type="button"
          class="button quiet sign"
          data-testid="delete-recording"
          aria-label={`Delete ${name}`}
          aria-expanded={asks}
          title={mayDelete ? "Delete it" : "Deleting takes the token of an admin"}
          disabled={state === "recording" || !mayDelete}
          onClick={() => setAsks(!asks)}
        >
          <Icon name="remove" />
        </button>
      </div>
      {asks && (
        <p class="recording-ask">
          Its files are deleted from the daemon’s disk, for everybody.
          <button type="button" class="button danger" data-testid="delete-surely" onClick={() => void deleteRecording(name)}>
            Delete {name}
          </button>
        </p>
      )}
      <Contents name={name} />
    </li>
  );
}

/** Contents of a recording, fetched when it is opened: the daemon reads the whole recording for it. */
function Contents({ name }: { name: string }): JSX.Element {
  const [contents, setContents] = useState<RecordingContents | undefined>();
  const [failed, setFailed] = useState(false);
  const read = async (): Promise<void> => {
    setFailed(false);
    const found = await recordingContents(name);
    setContents(found);
    setFailed(!found);
  };
  return (
    <details
      onToggle={(event) => {
        if (event.currentTarget.open && !contents) void read();
      }}
    >
      <summary class="hint" data-testid="recording-contents">
        <Icon name="chevron" /> What is in it
      </summary>
      {contents ? (
        <table class="topics">
          <caption class="hint">{durationText(contents.duration)} by the clock</caption>
          <tbody>
            {contents.topics.map(({ topic, schema, messages }) => (
              <tr key={topic}>
                <th scope="row">{topic}</th>
                <td>{schema}</td>
                <td class="tabular">{messages}</td>
              </tr>
            ))}
          </tbody>
        </table>
      ) : (
        <p class="hint">{failed ? "It could not be read. Close this and open it again to try once more." : "It is being read …"}</p>
      )}
    </details>
  );
}
