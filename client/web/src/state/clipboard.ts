// Copies text for the user.
import { toast } from "./toasts";

/** Copies a text. A message names it by `what`. If the browser refuses, the text is shown for copying by hand. */
export async function copy(text: string, what: string): Promise<boolean> {
  try {
    // Only pages over https or from this machine may write to the clipboard.
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    toast("info", `The browser does not let this page copy. ${what}: ${text}`);
    return false;
  }
}
