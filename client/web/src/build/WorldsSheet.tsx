// Saved states of the world: each can be put back, saved on this machine and deleted.
import type { JSX } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import { messageOf } from "../daemon/error-message";
import { deleteWorld, downloadWorld, listWorlds, restoreWorld, saveWorld, uploadWorld } from "../daemon/worlds";
import { Icon } from "../panels/icons";
import { Sheet } from "../panels/Sheet";
import { askFirst, tool } from "../state/tools";
import { role } from "../state/world";
import type { SavedWorld } from "../state/saved-worlds";

export function WorldsSheet(): JSX.Element {
  const [worlds, setWorlds] = useState<SavedWorld[] | null>(null);
  const [problem, setProblem] = useState("");
  const refresh = (): void => {
    listWorlds().then(
      (list) => {
        setWorlds(list);
        setProblem("");
      },
      (error: unknown) => setProblem(messageOf(error)),
    );
  };
  useEffect(refresh, []);
  return (
    <Sheet
      title="Saved worlds"
      testId="worlds-sheet"
      onClose={() => {
        // A question may have taken its place.
        if (tool.peek()?.kind === "worlds") tool.value = null;
      }}
    >
      <NewWorld done={refresh} />
      {problem !== "" && <p class="refusal">{problem}</p>}
      {worlds?.length === 0 && <p class="hint">There are none yet. A saved world has all robots as they are, their targets and the settings of physics.</p>}
      <ul class="recordings" data-testid="world-list">
        {worlds?.map((world) => (
          <Row key={world.name} world={world} done={refresh} />
        ))}
      </ul>
    </Sheet>
  );
}

/** Keeps the world as it is, and takes files of this machine. */
function NewWorld({ done }: { done: () => void }): JSX.Element {
  const name = useRef<HTMLInputElement>(null);
  const file = useRef<HTMLInputElement>(null);
  const isViewer = role.value === "viewer";
  return (
    <form
      class="new-recording"
      onSubmit={(event) => {
        event.preventDefault();
        void saveWorld(name.current?.value.trim() ?? "").then(done);
      }}
    >
      <input ref={name} type="text" class="filter" aria-label="Name of the saved world" placeholder="Name, or none" data-testid="world-name" maxLength={64} autocomplete="off" spellcheck={false} />
      <button type="submit" class="button" data-testid="world-save" disabled={isViewer}>
        <Icon name="plus" /> Save the world
      </button>
      <button type="button" class="button quiet" title="Take a saved world from a file of this machine" disabled={isViewer} onClick={() => file.current?.click()}>
        <Icon name="folder" /> Open a file
      </button>
      <input
        ref={file}
        type="file"
        hidden
        data-testid="world-file"
        aria-label="File of a saved world"
        onChange={(event) => {
          const [chosen] = event.currentTarget.files ?? [];
          if (chosen) void uploadWorld(chosen).then(done);
          event.currentTarget.value = "";
        }}
      />
    </form>
  );
}

function Row({ world, done }: { world: SavedWorld; done: () => void }): JSX.Element {
  const { name, simTime, robots, owner } = world;
  const [asks, setAsks] = useState(false);
  const isViewer = role.value === "viewer";
  const about = [`${simTime.toFixed(3)} s`, `${robots} ${robots === 1 ? "robot" : "robots"}`, owner === "" ? "" : `by ${owner}`];
  const restore = (): void => {
    tool.value = null;
    askFirst(`Put back ${name}`, "The world becomes what it was then, for everybody.", "Put it back", () => void restoreWorld(name));
  };
  return (
    <li data-testid={`world-${name}`}>
      <div class="recording-line">
        <div class="recording-name">
          <b title={name}>{name}</b>
          <span class="hint">{about.filter((part) => part !== "").join(" · ")}</span>
        </div>
        <button type="button" class="button" data-testid="world-restore" disabled={isViewer} onClick={restore}>
          <Icon name="reset" /> Put back
        </button>
        <button type="button" class="button quiet sign" data-testid="world-download" aria-label={`Save ${name} on this machine`} title="Save it on this machine" onClick={() => void downloadWorld(name)}>
          <Icon name="download" />
        </button>
        <button type="button" class="button quiet sign" data-testid="world-delete" aria-label={`Delete ${name}`} aria-expanded={asks} title="Delete it" disabled={isViewer} onClick={() => setAsks(!asks)}>
          <Icon name="remove" />
        </button>
      </div>
      {asks && (
        <p class="recording-ask">
          It is forgotten, for everybody.
          <button type="button" class="button danger" data-testid="world-delete-surely" onClick={() => void deleteWorld(name).then(done)}>
            Delete {name}
          </button>
        </p>
      )}
    </li>
  );
}
