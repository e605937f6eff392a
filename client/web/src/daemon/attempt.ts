// A call whose error is shown to the user.
import { toast } from "../state/toasts";
import { messageOf } from "./error-message";

/** Returns a function that does nothing while it runs: the page may still offer what a first press has begun. */
export function oneAtATime(act: () => Promise<unknown>): () => Promise<void> {
  let isRunning = false;
  return async () => {
    if (isRunning) return;
    isRunning = true;
    try {
      await act();
    } finally {
      isRunning = false;
    }
  };
}

/** Runs a change, and shows its error as a toast. Resolves to whether it succeeded. */
export async function attempt(change: () => Promise<unknown>): Promise<boolean> {
  try {
    await change();
    return true;
  } catch (error) {
    toast("error", messageOf(error));
    return false;
  }
}
