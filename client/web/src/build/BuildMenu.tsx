// The menu for building the world and looking into it.
import type { JSX } from "preact";
import { duplicate, takeOut } from "../daemon/building";
import { Icon, type IconName } from "../panels/icons";
import { OpenFile, OpenFolder } from "../panels/OpenFiles";
import { shownRobot } from "../panels/shown-robot";
import { film } from "../state/film";
import { whyNotAll, whyNotRemove, whyNotRobot, whyNotStep } from "../state/permission";
import { askFirst, placing, tool } from "../state/tools";
import { future, past, redo, undo } from "../state/undo";
import { simulation } from "../state/world";
import { beginFilmOfSteps, toggleFilm } from "./film";

/** Its content; `close` closes it. */
export function BuildMenu({ close }: { close: () => void }): JSX.Element {
  const name = shownRobot.value?.name;
  const whyNotAdd = whyNotAll.value;
  const whyNot = shownRobot.value ? whyNotRobot(shownRobot.value) : "";
  const whyNotGone = shownRobot.value ? whyNotRemove(shownRobot.value) : "";
  const then = (run: () => void) => () => {
    close();
    run();
  };
  const remove = (robot: string): void => askFirst(`Remove ${robot}`, `${robot} is removed from the world, for everybody.`, "Remove it", () => void takeOut(robot));
  return (
    <div class="view-menu build-menu" data-testid="build-menu">
      <Item icon="plus" testId="build-add" text="Add a shape or ground …" whyNot={whyNotAdd} run={then(() => (tool.value = { kind: "add" }))} />
      <OpenFolder class="button">
        <Icon name="folder" /> Choose a folder …
      </OpenFolder>
      <OpenFile class="button">
        <Icon name="file" /> Choose a file …
      </OpenFile>
      {name !== undefined && (
        <>
          <Item icon="axes" testId="build-place" text={`Move ${name} …`} whyNot={whyNot} run={then(() => (placing.value = { robot: name }))} />
          <Item icon="copy" testId="build-duplicate" text={`Duplicate ${name}`} whyNot={whyNotAdd} run={then(() => void duplicate(name))} />
          <Item icon="remove" testId="build-remove" text={`Remove ${name}`} whyNot={whyNotGone} run={then(() => remove(name))} />
        </>
      )}
      <Item icon="undo" testId="build-undo" text={`Undo ${past.value.at(-1)?.what ?? ""}`} disabled={past.value.length === 0} run={() => void undo()} />
      <Item icon="redo" testId="build-redo" text={`Redo ${future.value.at(-1)?.what ?? ""}`} disabled={future.value.length === 0} run={() => void redo()} />
      <Item icon="visuals" testId="build-robots" text="All robots …" run={then(() => (tool.value = { kind: "robots" }))} />
      <Item icon="saved" testId="build-states" text="Saved states …" run={then(() => (tool.value = { kind: "saved-states" }))} />
      {simulation.value.state === "paused" && !film.value && (
        <Item icon="step" testId="build-film-steps" text="Take a video by steps (WebM)" whyNot={whyNotStep.value} run={then(() => void beginFilmOfSteps())} />
      )}
      <Item icon={film.value ? "stop" : "camera"} testId="build-film" text={film.value ? "End the video, and save it" : "Take a video (WebM)"} run={then(toggleFilm)} />
    </div>
  );
}

interface ItemProperties {
  icon: IconName;
  text: string;
  testId: string;
  disabled?: boolean;
  /** Reason why it is forbidden; empty if it is not. */
  whyNot?: string;
  run: () => void;
}

function Item({ icon, text, testId, disabled = false, whyNot = "", run }: ItemProperties): JSX.Element {
  return (
    <button type="button" class="button" data-testid={testId} disabled={disabled || whyNot !== ""} title={whyNot || text} onClick={run}>
      <Icon name={icon} /> {text}
    </button>
  );
}
