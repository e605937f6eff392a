// Note that keys of the page go to a program.
import type { JSX } from "preact";
import { inputFor } from "../state/input";

/** Rendered only while a program asks for keys. */
export function InputNote(): JSX.Element | null {
  const program = inputFor.value;
  if (program === null) return null;
  return (
    <p class="input-note" role="status" data-testid="input-note">
      Keys and mouse go to {program === "" ? "a program" : <b>{program}</b>}
    </p>
  );
}
