// The menu for building the world and looking into it.
import type { JSX } from "preact";
import { duplicate, takeOut } from "../daemon/building";
import { Icon, type IconName } from "../panels/icons";
import { OpenFile, OpenFolder } from "../panels/OpenFiles";
import { shownRobot } from "../panels/shown-robot";
import { film } from "../state/film";
import { askFirst, placing, tool } from "../state/tools";
import { future, past, redo, undo } from "../state/undo";
import { role, simulation } from "../state/world";
import { beginFilmOfSteps, toggleFilm } from "./film";

/** Its content; `close` closes it. */
export function BuildMenu({ close }: { close: () => void }): JSX.Element {
  const name = shownRobot.value?.name;
  const isViewer = role.value === "viewer";
  const then = (run: () => void) => () => {
    close();
    run();
  };
  const remove = (robot: string): void => askFirst(`Remove ${robot}`, `${robot} is taken out of the world, for everybody.`, "Remove it", () => void takeOut(robot));
  return (
    <div class="view-menu build-menu" data-testid="build-menu">
      <Item icon="plus" testId="build-add" text="Add a shape or ground …" disabled={isViewer} run={then(() => (tool.value = { kind: "add" }))} />
      <OpenFolder class="button">
        <Icon name="folder" /> Choose a folder …
      </OpenFolder>
      <OpenFile class="button">
        <Icon name="file" /> Choose a file …
      </OpenFile>
      {name !== undefined && (
        <>
          <Item icon="axes" testId="build-place" text={`Move ${name} …`} disabled={isViewer} run={then(() => (placing.value = { robot: name }))} />
          <Item icon="copy" testId="build-duplicate" text={`Duplicate ${name}`} disabled={isViewer} run={then(() => void duplicate(name))} />
          <Item icon="remove" testId="build-remove" text={`Remove ${name}`} disabled={isViewer} run={then(() => remove(name))} />
        </>
      )}
      <Item icon="undo" testId="build-undo" text={`Undo ${past.value.at(-1)?.what ?? ""}`} disabled={past.value.length === 0} run={() => void undo()} />
      <Item icon="redo" testId="build-redo" text={`Redo ${future.value.at(-1)?.what ?? ""}`} disabled={future.value.length === 0} run={() => void redo()} />
      <Item icon="visuals" testId="build-robots" text="All robots …" run={then(() => (tool.value = { kind: "robots" }))} />
      <Item icon="saved" testId="build-states" text="Saved states …" run={then(() => (tool.value = { kind: "saved-states" }))} />
      {simulation.value.state === "paused" && !film.value && (
        <Item icon="step" testId="build-film-steps" text="Take a video by steps (WebM)" disabled={isViewer} run={then(() => void beginFilmOfSteps())} />
      )}
      <Item icon={film.value ? "stop" : "camera"} testId="build-film" text={film.value ? "End the video, and save it" : "Take a video (WebM)"} run={then(toggleFilm)} />
    </div>
  );
}

function Item({ icon, text, testId, disabled = false, run }: { icon: IconName; text: string; testId: string; disabled?: boolean; run: () => void }): JSX.Element {
  return (
    <button type="button" class="button" data-testid={testId} disabled={disabled} title={text} onClick={run}>
      <Icon name={icon} /> {text}
    </button>
  );
}
