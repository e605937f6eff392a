// Saved states of the world: each can be restored, saved on this machine and deleted.
import type { JSX } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import { messageOf } from "../daemon/error-message";
import { deleteState, downloadState, listSavedStates, restoreState, saveState, uploadState } from "../daemon/saved-states";
import { Icon } from "../panels/icons";
import { Sheet } from "../panels/Sheet";
import { whyNotAll, whyNotWorld } from "../state/permission";
import { askFirst, tool } from "../state/tools";
import type { SavedState } from "../state/saved-states";

export function SavedStatesSheet(): JSX.Element {
  const [states, setStates] = useState<SavedState[] | null>(null);
  const [problem, setProblem] = useState("");
  const refresh = (): void => {
    listSavedStates().then(
      (list) => {
        setStates(list);
        setProblem("");
      },
      (error: unknown) => setProblem(messageOf(error)),
    );
  };
  useEffect(refresh, []);
  return (
    <Sheet
      title="Saved states"
      testId="states-sheet"
      onClose={() => {
        // A question may have replaced it.
        if (tool.peek()?.kind === "saved-states") tool.value = null;
      }}
    >
      <NewState done={refresh} />
      {problem !== "" && <p class="refusal">{problem}</p>}
      {states?.length === 0 && <p class="hint">No saved states yet. A saved state keeps all robots, their targets and the settings of physics.</p>}
      <ul class="recordings" data-testid="state-list">
        {states?.map((state) => (
          <Row key={state.name} state={state} done={refresh} />
        ))}
      </ul>
    </Sheet>
  );
}

/** Saves the present world, and loads files of this machine. */
function NewState({ done }: { done: () => void }): JSX.Element {
  const name = useRef<HTMLInputElement>(null);
  const file = useRef<HTMLInputElement>(null);
  const whyNot = whyNotAll.value;
  return (
    <form
      class="new-recording"
      onSubmit={(event) => {
        event.preventDefault();
        void saveState(name.current?.value.trim() ?? "").then(done);
      }}
    >
      <input ref={name} type="text" class="filter" aria-label="Name of the saved state" placeholder="Name (optional)" data-testid="state-name" maxLength={64} autocomplete="off" spellcheck={false} />
      <button type="submit" class="button" data-testid="state-save" title={whyNot} disabled={whyNot !== ""}>
        <Icon name="plus" /> Save the world
      </button>
      <button type="button" class="button quiet" title={whyNot || "Load a saved state from a file of this machine"} disabled={whyNot !== ""} onClick={() => file.current?.click()}>
        <Icon name="folder" /> Open a file
      </button>
      <input
        ref={file}
        type="file"
        hidden
        data-testid="state-file"
        aria-label="File of a saved state"
        onChange={(event) => {
          const [chosen] = event.currentTarget.files ?? [];
          if (chosen) void uploadState(chosen).then(done);
          event.currentTarget.value = "";
        }}
      />
    </form>
  );
}

function Row({ state, done }: { state: SavedState; done: () => void }): JSX.Element {
  const { name, simTime, robots, owner } = state;
  const [asks, setAsks] = useState(false);
  const whyNot = whyNotAll.value;
  const about = [`${simTime.toFixed(3)} s`, `${robots} ${robots === 1 ? "robot" : "robots"}`, owner === "" ? "" : `by ${owner}`];
  const restore = (): void => {
    tool.value = null;
    askFirst(`Put back ${name}`, "The world returns to this state, for everybody.", "Put it back", () => void restoreState(name));
  };
  return (
    <li data-testid={`state-${name}`}>
      <div class="recording-line">
        <div class="recording-name">
          <b title={name}>{name}</b>
          <span class="hint">{about.filter((part) => part !== "").join(" · ")}</span>
        </div>
        <button type="button" class="button" data-testid="state-restore" title={whyNotWorld.value} disabled={whyNotWorld.value !== ""} onClick={restore}>
          <Icon name="reset" /> Put back
        </button>
        <button type="button" class="button quiet sign" data-testid="state-download" aria-label={`Save ${name} on this machine`} title="Save it on this machine" onClick={() => void downloadState(name)}>
          <Icon name="download" />
        </button>
        <button type="button" class="button quiet sign" data-testid="state-delete" aria-label={`Delete ${name}`} aria-expanded={asks} title={whyNot || "Delete it"} disabled={whyNot !== ""} onClick={() => setAsks(!asks)}>
          <Icon name="remove" />
        </button>
      </div>
      {asks && (
        <p class="recording-ask">
          It is deleted, for everybody.
          <button type="button" class="button danger" data-testid="state-delete-surely" onClick={() => void deleteState(name).then(done)}>
            Delete {name}
          </button>
        </p>
      )}
    </li>
  );
}
