// The theme, light or dark: the setting of the page, or else of the system, as an attribute of the root element.
import { computed, effect, signal, type ReadonlySignal } from "@preact/signals";
import { theme } from "../state/view";

const dark = matchMedia("(prefers-color-scheme: dark)");
const systemIsDark = signal(dark.matches);
dark.addEventListener("change", (event) => {
  systemIsDark.value = event.matches;
});

/** The present theme. */
export const shownTheme: ReadonlySignal<"light" | "dark"> = computed(() =>
  theme.value === "system" ? (systemIsDark.value ? "dark" : "light") : theme.value,
);

effect(() => {
  document.documentElement.dataset["theme"] = shownTheme.value;
});
