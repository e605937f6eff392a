// Light or dark: what people chose, or else what the system has, on the root element.
import { computed, effect, signal, type ReadonlySignal } from "@preact/signals";
import { theme } from "../state/view";

const dark = matchMedia("(prefers-color-scheme: dark)");
const systemIsDark = signal(dark.matches);
dark.addEventListener("change", (event) => {
  systemIsDark.value = event.matches;
});

/** What is shown now. */
export const shownTheme: ReadonlySignal<"light" | "dark"> = computed(() =>
  theme.value === "system" ? (systemIsDark.value ? "dark" : "light") : theme.value,
);

effect(() => {
  document.documentElement.dataset["theme"] = shownTheme.value;
});
