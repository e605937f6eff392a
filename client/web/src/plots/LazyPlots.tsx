// The drawer with the plots, whose code is loaded with its first opening, so that the first view does not wait for it.
import { signal } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect } from "preact/hooks";
import { toast } from "../state/toasts";
import { plotsOpen } from "../state/view";
// The recorder starts with the page, so that a plot has a past.
import "./recorder";

const drawer = signal<(() => JSX.Element) | null>(null);

async function load(): Promise<void> {
  try {
    drawer.value ??= (await import("./PlotsDrawer")).PlotsDrawer;
  } catch {
    plotsOpen.value = false;
    toast("error", "The plots could not be loaded from the daemon; open them again once it answers.");
  }
}

/** Rendered only while the drawer is open. */
export function LazyPlots(): JSX.Element | null {
  useEffect(() => void load(), []);
  const Drawer = drawer.value;
  return Drawer && <Drawer />;
}
