// A call whose error is shown to the user.
import { toast } from "../state/toasts";
import { messageOf } from "./error-message";

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
