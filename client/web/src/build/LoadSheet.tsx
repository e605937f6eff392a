// Options of a dropped or chosen robot: name, position, fixed base, and collision meshes.
import type { JSX } from "preact";
import { useEffect, useState } from "preact/hooks";
import { loadFiles, type DroppedFile } from "../daemon/actions";
import { Icon } from "../panels/icons";
import { Sheet } from "../panels/Sheet";
import { findDescriptions, shownPath, type Description } from "../load/descriptions";
import { DEFAULT_OPTIONS, type LoadOptions } from "../load/load";
import { isXacro } from "../load/xacro";
import { tool } from "../state/tools";
import { ChoiceField, NameField, NumberField } from "./Fields";
import { LoadChoices } from "./LoadChoices";
import { XacroArguments } from "./XacroArguments";

const BASES = [
  ["described", "as the description says"],
  ["fixed", "fixed to the world"],
  ["free", "free to move"],
] as const;

const MESHES = [
  ["mesh", "mesh if it cannot move, else hull"],
  ["hull", "convex hulls"],
  ["parts", "convex parts (slow for large meshes)"],
] as const;

/** The coordinates, and what stands for each if the user enters none. */
const PLACES = [
  ["x", "0"],
  ["y", "beside"],
  ["z", "0"],
] as const;

/** Message if nothing in the drop can be loaded. */
const NOTHING = "The dropped files have no URDF, xacro, SDF or MJCF: drop the robot's folder or its zip, or its .urdf with its meshes.";

export function LoadSheet({ files }: { files: DroppedFile[] }): JSX.Element {
  const [options, setOptions] = useState<LoadOptions>(DEFAULT_OPTIONS);
  /** Undefined while the files are read. */
  const [found, setFound] = useState<Description[]>();
  const [chosen, choose] = useState<ReadonlySet<string>>(new Set());
  /** Arguments by file. */
  const [values, setValues] = useState<Record<string, Record<string, string>>>({});
  useEffect(() => {
    let isGone = false;
    void findDescriptions(files).then((all) => {
      if (isGone) return;
      setFound(all);
      choose(new Set(all.slice(0, 1).map(({ path }) => path)));
    });
    return () => {
      isGone = true;
    };
  }, [files]);
  const close = (): void => {
    tool.value = null;
  };
  const set = (change: Partial<LoadOptions>): void => setOptions({ ...options, ...change });
  const place = (change: LoadOptions["position"]): void => set({ position: { ...options.position, ...change } });
  const paths = (found ?? []).map(({ path }) => path).filter((path) => chosen.has(path));
  const xacros = paths.filter(isXacro);
  return (
    <Sheet title="Load a robot" testId="load-sheet" onClose={close}>
      {found === undefined ? (
        <p class="hint" role="status">
          Looking at {files.length} files …
        </p>
      ) : found.length === 0 ? (
        <p class="refusal" data-testid="load-problem">
          {NOTHING}
        </p>
      ) : (
        <form
          class="build-form"
          onSubmit={(event) => {
            event.preventDefault();
            close();
            void loadFiles(files, paths.map((path) => ({ path, values: given(values[path]) })), paths.length > 1 ? { ...options, name: "" } : options);
          }}
        >
          {found.length === 1 ? <Only description={found[0]} others={files.length - 1} /> : <LoadChoices found={found} chosen={chosen} onChange={choose} />}
          {xacros.map((path) => (
            <XacroArguments
              key={path}
              file={files.find((each) => each.path === path)?.file}
              {...(paths.length > 1 && { name: shownPath(path, paths) })}
              values={values[path] ?? {}}
              onChange={(next) => setValues({ ...values, [path]: next })}
            />
          ))}
          {paths.length <= 1 && <NameField value={options.name} placeholder="from the description" onChange={(name) => set({ name })} />}
          <fieldset class="build-row">
            <legend>{paths.length > 1 ? "Place of the first" : "Place"}</legend>
            {PLACES.map(([axis, placeholder]) => (
              <NumberField
                key={axis}
                label={axis}
                testId={`load-${axis}`}
                value={options.position?.[axis]}
                placeholder={placeholder}
                onChange={(value) => place({ [axis]: value })}
                onClear={() => place({ [axis]: undefined })}
              />
            ))}
            <NumberField label="yaw" testId="load-yaw" kind="angle" value={options.yaw} onChange={(yaw) => set({ yaw })} />
          </fieldset>
          <p class="hint">
            Without y it stands beside the other robots. Without x, y and z its lowest point is put on z = 0 where it would be below.
            {paths.length > 1 && " The others stand beside it."}
          </p>
          <div class="build-row">
            <ChoiceField label="Base" testId="load-base" value={options.base} options={BASES} onChange={(base) => set({ base })} />
            <ChoiceField label="Collision meshes" testId="load-meshes" value={options.meshes} options={MESHES} onChange={(meshes) => set({ meshes })} />
            <NumberField label="Scale" testId="load-scale" kind="number" value={options.scale} onChange={(scale) => set({ scale })} />
          </div>
          <button type="submit" class="button primary" data-testid="load-now" autofocus disabled={paths.length === 0}>
            <Icon name="folder" /> {paths.length > 1 ? `Load ${paths.length} robots` : "Load"}
          </button>
        </form>
      )}
    </Sheet>
  );
}

/** The only description. */
function Only({ description, others }: { description: Description | undefined; others: number }): JSX.Element | null {
  if (!description) return null;
  const { path, kind, links } = description;
  return (
    <p>
      <b data-testid="load-found">{shownPath(path, [])}</b>{" "}
      <span class="hint">
        {kind}
        {links !== undefined && `, ${links} ${links === 1 ? "link" : "links"}`}
        {others > 0 && `; and ${others} other ${others === 1 ? "file" : "files"}`}
      </span>
    </p>
  );
}

/** Values that the user has entered. */
function given(values: Readonly<Record<string, string>> = {}): Record<string, string> {
  return Object.fromEntries(Object.entries(values).filter(([, value]) => value !== ""));
}
