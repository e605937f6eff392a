// Whether the sheet of how to begin is open.
import { signal } from "@preact/signals";

export const guideOpen = signal(false);
