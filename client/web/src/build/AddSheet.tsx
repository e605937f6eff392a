// Adds a shape, ground or a height field to the world.
import type { JSX } from "preact";
import { useState } from "preact/hooks";
import { bringIn } from "../daemon/building";
import { messageOf } from "../daemon/error-message";
import { services } from "../daemon/services";
import { sha256 } from "../load/sha256";
import { uploadFile } from "../load/upload";
import { Icon } from "../panels/icons";
import { Sheet } from "../panels/Sheet";
import { tool } from "../state/tools";
import { ChoiceField, NameField, NumberField } from "./Fields";
import { problemOf, requestOf, type ShapeForm, type ShapeKind } from "./shapes";

const KINDS: readonly (readonly [ShapeKind, string])[] = [
  ["box", "Box"],
  ["sphere", "Sphere"],
  ["cylinder", "Cylinder"],
  ["capsule", "Capsule"],
  ["cone", "Cone"],
  ["plane", "Ground: a plane"],
  ["heights", "Ground: a height field"],
];

const FIRST: ShapeForm = { kind: "box", name: "", size: [0.2, 0.2, 0.2], radius: 0.1, length: 0.2, mass: 1, fixed: false, at: [0, 0, 0.5], color: "" };

export function AddSheet(): JSX.Element {
  const [form, setForm] = useState<ShapeForm>(FIRST);
  const [file, setFile] = useState<File | null>(null);
  const [problem, setProblem] = useState("");
  const [busy, setBusy] = useState(false);
  const set = (change: Partial<ShapeForm>): void => setForm({ ...form, ...change });
  const { kind } = form;
  const isGround = kind === "plane" || kind === "heights";
  const close = (): void => {
    // Another sheet may have taken its place while a file was sent.
    if (tool.peek()?.kind === "add") tool.value = null;
  };
  const add = async (): Promise<void> => {
    const wrong = problemOf(form) ?? (kind === "heights" && !file ? "Choose a grey PNG, or a CSV file of heights." : undefined);
    setProblem(wrong ?? "");
    if (wrong !== undefined) return;
    setBusy(true);
    try {
      const sent = kind === "heights" && file ? await upload(file) : undefined;
      if ((await bringIn(requestOf(form, sent))) !== undefined) close();
    } catch (error) {
      setProblem(messageOf(error));
    }
    setBusy(false);
  };
  const choose = (next: ShapeKind): void => {
    // Ground begins at z = 0; a height field of a useful size.
    if (next === "heights") set({ kind: next, at: [0, 0, 0], size: [20, 20, 2] });
    else if (next === "plane") set({ kind: next, at: [0, 0, 0] });
    else set({ kind: next, ...(isGround && { at: FIRST.at, size: FIRST.size }) });
  };
  return (
    <Sheet title="Add to the world" testId="add-sheet" onClose={close}>
      <form
        class="build-form"
        onSubmit={(event) => {
          event.preventDefault();
          void add();
        }}
      >
        <div class="build-row">
          <ChoiceField label="What" testId="add-kind" value={kind} options={KINDS} onChange={choose} />
          <NameField value={form.name} placeholder={isGround ? "ground" : kind} onChange={(name) => set({ name })} />
        </div>
        <Lengths form={form} set={set} />
        {kind === "heights" && (
          <label class="build-field">
            <span>Heights: a grey PNG, or a CSV file</span>
            <input type="file" accept=".png,.csv" data-testid="add-heights" onChange={(event) => setFile(event.currentTarget.files?.[0] ?? null)} />
          </label>
        )}
        <fieldset class="build-row">
          <legend>Where</legend>
          {(["x", "y", "z"] as const).map((axis, index) => (
            <NumberField key={axis} label={axis} testId={`add-${axis}`} value={form.at[index] ?? 0} onChange={(value) => set({ at: replaced(form.at, index, value) })} />
          ))}
        </fieldset>
        {!isGround && (
          <div class="build-row">
            <NumberField label="Mass (kg; 0 is that of water)" testId="add-mass" kind="number" value={form.mass} onChange={(mass) => set({ mass })} />
            <label class="build-check">
              <input type="checkbox" data-testid="add-fixed" checked={form.fixed} onChange={(event) => set({ fixed: event.currentTarget.checked })} /> fixed to the world
            </label>
            <label class="build-check">
              <input type="checkbox" checked={form.color !== ""} onChange={(event) => set({ color: event.currentTarget.checked ? "#3b82f6" : "" })} /> colour
              {form.color !== "" && <input type="color" aria-label="Colour" value={form.color} onInput={(event) => set({ color: event.currentTarget.value })} />}
            </label>
          </div>
        )}
        {problem !== "" && (
          <p class="refusal" role="alert" data-testid="add-problem">
            {problem}
          </p>
        )}
        <button type="submit" class="button primary" data-testid="add-now" disabled={busy}>
          <Icon name="plus" /> Add
        </button>
      </form>
    </Sheet>
  );
}

function Lengths({ form, set }: { form: ShapeForm; set: (change: Partial<ShapeForm>) => void }): JSX.Element | null {
  const { kind, size, radius, length } = form;
  if (kind === "plane") return <p class="hint">Everything below it is solid. A plane cannot move.</p>;
  if (kind === "box" || kind === "heights") {
    const labels = kind === "box" ? ["x", "y", "z"] : ["along x", "along y", "highest"];
    return (
      <fieldset class="build-row">
        <legend>Size</legend>
        {labels.map((label, index) => (
          <NumberField key={label} label={label} testId={`add-size-${index}`} value={size[index] ?? 0} onChange={(value) => set({ size: replaced(size, index, value) })} />
        ))}
      </fieldset>
    );
  }
  return (
    <fieldset class="build-row">
      <legend>Size</legend>
      <NumberField label="radius" testId="add-radius" value={radius} onChange={(value) => set({ radius: value })} />
      {kind !== "sphere" && <NumberField label={kind === "capsule" ? "length without caps" : "length"} testId="add-length" value={length} onChange={(value) => set({ length: value })} />}
    </fieldset>
  );
}

function replaced([x, y, z]: readonly [number, number, number], index: number, value: number): [number, number, number] {
  return [index === 0 ? value : x, index === 1 ? value : y, index === 2 ? value : z];
}

async function upload(file: File): Promise<{ name: string; sha256: string }> {
  const bytes = new Uint8Array(await file.arrayBuffer());
  const hash = await sha256(bytes);
  await uploadFile(services().entities, hash, bytes);
  return { name: file.name, sha256: hash };
}
