// The size of text: the setting of the page, or by the width of the window, as an attribute of the root element.
import { computed, effect, signal, type ReadonlySignal } from "@preact/signals";
import { textSize } from "../state/view";

/** Widths in CSS pixels from which text is larger: windows over screens of 4k without scaling. */
const WIDE = matchMedia("(min-width: 2400px)");
const WIDER = matchMedia("(min-width: 3200px)");

const byWindow = signal(measured());
for (const query of [WIDE, WIDER]) {
  query.addEventListener("change", () => {
    byWindow.value = measured();
  });
}

function measured(): "100" | "125" | "150" {
  return WIDER.matches ? "150" : WIDE.matches ? "125" : "100";
}

/** Percent of the size of the browser. */
export const shownTextSize: ReadonlySignal<string> = computed(() => (textSize.value === "auto" ? byWindow.value : textSize.value));

effect(() => {
  document.documentElement.dataset["textSize"] = shownTextSize.value;
});
