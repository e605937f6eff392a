// What a robot becomes that was dropped or chosen: its name, where it is, whether its base is fixed, and what it touches with.
import type { JSX } from "preact";
import { useEffect, useState } from "preact/hooks";
import { loadFiles, type DroppedFile } from "../daemon/actions";
import { Icon } from "../panels/icons";
import { Sheet } from "../panels/Sheet";
import { DEFAULT_OPTIONS, type LoadOptions } from "../load/load";
import { nextSpawnPosition } from "../load/spawn-position";
import { MOUNT, nameOf } from "../load/tree";
import { findUrdfs } from "../load/urdfs";
import { argumentsIn, findXacros, shownPath, type XacroArgument } from "../load/xacro";
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

/** Of a file's arguments, those that have a field. */
const MOST_ARGUMENTS = 60;

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
  const xacros = findXacros(files.map(({ path }) => path));
  // A complete description needs nothing to be asked for. Beside xacro, XML is seldom MJCF: packages of ROS have launch files.
  const isComplete = typeof found !== "string" && !found.every((name) => /\.xml$/i.test(name));
  const [chosen, choose] = useState(isComplete ? "" : (xacros[0] ?? ""));
  const [values, setValues] = useState<Record<string, string>>({});
  const close = (): void => {
    tool.value = null;
  };
  const set = (change: Partial<LoadOptions>): void => setOptions({ ...options, ...change });
  const at = options.position ?? nextSpawnPosition(scenes.peek(), frame.peek());
  const place = (change: Partial<typeof at>): void => {
    setPlaced(true);
    set({ position: { ...at, ...change } });
  };
  const descriptions = typeof found === "string" ? [] : [["", found.join(", ")] as const];
  const isMany = chosen === "" && typeof found !== "string" && found.length > 1;
  const count = files.length - (chosen === "" && typeof found !== "string" ? found.length : 1);
  return (
    <Sheet title="Load a robot" testId="load-sheet" onClose={close}>
      {typeof found === "string" && xacros.length === 0 ? (
        <p class="refusal" data-testid="load-problem">
          {found}
        </p>
      ) : (
        <form
          class="build-form"
          onSubmit={(event) => {
            event.preventDefault();
            close();
            void loadFiles(files, chosen === "" ? options : { ...options, xacro: { path: chosen, values: given(values) } });
          }}
        >
          {xacros.length === 0 || (xacros.length === 1 && descriptions.length === 0) ? (
            <p>
              <b data-testid="load-found">{chosen === "" ? descriptions[0]?.[1] : nameOf(chosen)}</b> <span class="hint">and {count} other files</span>
            </p>
          ) : (
            <ChoiceField
              label="Description"
              testId="load-description"
              value={chosen}
              options={[...descriptions, ...xacros.map((path) => [path, shownPath(path, xacros)] as const)]}
              onChange={(path) => {
                setValues({});
                choose(path);
              }}
            />
          )}
          {chosen !== "" && <XacroArguments key={chosen} file={files.find(({ path }) => path === chosen)?.file} values={values} onChange={setValues} />}
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

/** What the user has said. */
function given(values: Readonly<Record<string, string>>): Record<string, string> {
  return Object.fromEntries(Object.entries(values).filter(([, value]) => value !== ""));
}

/** A field for each argument that a xacro file declares; left empty it is the file's default. */
function XacroArguments({ file, values, onChange }: { file: File | undefined; values: Record<string, string>; onChange: (values: Record<string, string>) => void }): JSX.Element | null {
  const [declared, setDeclared] = useState<XacroArgument[]>([]);
  useEffect(() => {
    let isGone = false;
    void file?.text().then((text) => {
      if (!isGone) setDeclared(argumentsIn(text).slice(0, MOST_ARGUMENTS));
    });
    return () => {
      isGone = true;
    };
  }, [file]);
  if (declared.length === 0) return null;
  return (
    <fieldset class="build-row">
      <legend>Arguments of the xacro</legend>
      {declared.map(({ name, preset }) => (
        <label key={name} class="build-field">
          <span>{name}</span>
          <input
            type="text"
            class="filter"
            data-testid={`load-arg-${name}`}
            placeholder={preset ?? "has to be given"}
            title={preset === undefined ? `${name} has no default` : `${name}; left empty it is "${preset}"`}
            required={preset === undefined}
            autocomplete="off"
            spellcheck={false}
            value={values[name] ?? ""}
            onInput={(event) => onChange({ ...values, [name]: event.currentTarget.value })}
          />
        </label>
      ))}
    </fieldset>
  );
}
