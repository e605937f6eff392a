// What a robot becomes that was dropped or chosen: its name, where it is, whether its base is fixed, and what it touches with.
import type { JSX } from "preact";
import { useState } from "preact/hooks";
import { loadFiles, type DroppedFile } from "../daemon/actions";
import { simctl } from "../panels/load-command";
import { Icon } from "../panels/icons";
import { Sheet } from "../panels/Sheet";
import { DEFAULT_OPTIONS, type LoadOptions } from "../load/load";
import { nextSpawnPosition } from "../load/spawn-position";
import { MOUNT, nameOf } from "../load/tree";
import { findUrdfs } from "../load/urdfs";
import { scenes } from "../state/scene";
import { tool } from "../state/tools";
import { frame } from "../state/world";
import { ChoiceField, NameField, NumberField } from "./Fields";

const BASES = [
  ["fixed", "fixed to the world"],
  ["free", "free to move"],
  ["described", "as the description says"],
] as const;

const MESHES = [
  ["mesh", "mesh where it cannot move, else hull"],
  ["hull", "convex hulls"],
  ["parts", "convex parts (slow for large meshes)"],
] as const;

/** The descriptions among the files, by name; or why there is none. */
export function describedBy(files: readonly DroppedFile[]): string[] | string {
  try {
    return findUrdfs(files.map(({ path }) => `${MOUNT}/${path}`)).map(nameOf);
  } catch (error) {
    return error instanceof Error ? error.message : String(error);
  }
}

export function LoadSheet({ files }: { files: DroppedFile[] }): JSX.Element {
  const [options, setOptions] = useState<LoadOptions>(DEFAULT_OPTIONS);
  const [placed, setPlaced] = useState(false);
  const found = describedBy(files);
  const close = (): void => {
    tool.value = null;
  };
  const set = (change: Partial<LoadOptions>): void => setOptions({ ...options, ...change });
  const at = options.position ?? nextSpawnPosition(scenes.peek(), frame.peek());
  const place = (change: Partial<typeof at>): void => {
    setPlaced(true);
    set({ position: { ...at, ...change } });
  };
  const isMany = typeof found !== "string" && found.length > 1;
  return (
    <Sheet title="Load a robot" testId="load-sheet" onClose={close}>
      {typeof found === "string" ? (
        <Nothing why={found} files={files} />
      ) : (
        <form
          class="build-form"
          onSubmit={(event) => {
            event.preventDefault();
            close();
            void loadFiles(files, options);
          }}
        >
          <p>
            <b data-testid="load-found">{found.join(", ")}</b> <span class="hint">and {files.length - found.length} other files</span>
          </p>
          {!isMany && <NameField value={options.name} placeholder="that of the description" onChange={(name) => set({ name })} />}
          <fieldset class="build-row">
            <legend>Where</legend>
            <NumberField label="x" testId="load-x" value={at.x} onChange={(x) => place({ x })} />
            <NumberField label="y" testId="load-y" value={at.y} onChange={(y) => place({ y })} />
            <NumberField label="z" testId="load-z" value={at.z} onChange={(z) => place({ z })} />
            <NumberField label="yaw" testId="load-yaw" kind="angle" value={options.yaw} onChange={(yaw) => set({ yaw })} />
          </fieldset>
          {!placed && <p class="hint">Its lowest point is put on z = 0 where it would be below.</p>}
          <div class="build-row">
            <ChoiceField label="Base" testId="load-base" value={options.base} options={BASES} onChange={(base) => set({ base })} />
            <ChoiceField label="Collision meshes" testId="load-meshes" value={options.meshes} options={MESHES} onChange={(meshes) => set({ meshes })} />
            <NumberField label="Scale" testId="load-scale" kind="number" value={options.scale} onChange={(scale) => set({ scale })} />
          </div>
          <button type="submit" class="button primary" data-testid="load-now" autofocus>
            <Icon name="folder" /> Load
          </button>
        </form>
      )}
    </Sheet>
  );
}

/** Why nothing can be loaded; and of xacro, which the page does not expand, what does. */
function Nothing({ why, files }: { why: string; files: readonly DroppedFile[] }): JSX.Element {
  const xacro = files.find(({ path }) => /\.xacro$/i.test(path));
  return (
    <>
      <p class="refusal" data-testid="load-problem">
        {why}
      </p>
      {xacro && (
        <>
          <p>The page does not expand xacro. simctl does, with its arguments:</p>
          <pre>
            <code>{simctl(`robot load ${xacro.path} --xacro-arg NAME=VALUE`, location.host)}</code>
          </pre>
        </>
      )}
    </>
  );
}
