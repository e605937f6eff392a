// Fields whose value changes while users look at them: text that is wholly selected stays so, and the next key replaces it.
import { useLayoutEffect } from "preact/hooks";

/** Selects a focused field's text again if all of it was selected and this rendering changes it: browsers drop the selection then. */
export function useKeptSelection(field: { current: HTMLInputElement | null }): void {
  const before = selectedText(field.current);
  useLayoutEffect(() => {
    if (before !== undefined && field.current && field.current.value !== before) field.current.select();
  });
}

/** Returns the text of a focused field that is wholly selected. */
function selectedText(field: HTMLInputElement | null): string | undefined {
  if (!field || document.activeElement !== field || field.value === "") return undefined;
  return field.selectionStart === 0 && field.selectionEnd === field.value.length ? field.value : undefined;
}
