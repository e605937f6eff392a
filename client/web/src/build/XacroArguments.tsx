// The arguments of a xacro file, each with a field.
import type { JSX } from "preact";
import { useEffect, useState } from "preact/hooks";
import { argumentsIn, type XacroArgument } from "../load/xacro";

/** Arguments of a file that have a field. */
const MOST_ARGUMENTS = 60;

interface Properties {
  file: File | undefined;
  /** Names the file if several have arguments. */
  name?: string;
  values: Readonly<Record<string, string>>;
  onChange: (values: Record<string, string>) => void;
}

/** A field for each argument that a xacro file declares; an empty one means the file's default. */
export function XacroArguments({ file, name: of, values, onChange }: Properties): JSX.Element | null {
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
      <legend>{of === undefined ? "Arguments of the xacro" : `Arguments of ${of}`}</legend>
      {declared.map(({ name, preset }) => (
        <label key={name} class="build-field">
          <span>{name}</span>
          <input
            type="text"
            class="filter"
            data-testid={`load-arg-${name}`}
            placeholder={preset ?? "required"}
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
