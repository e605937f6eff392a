// Steps of a paused world, one call after the other, for code that needs to see each.
import { toast } from "../state/toasts";
import { messageOf } from "./error-message";
import { daemonConnection } from "./page";
import { services } from "./services";

/** Milliseconds that a stopped call may still take. The daemon mostly finishes the step, and the state that is shown then contains it. */
const GRACE = 2000;

/**
 * Steps the world. Resolves to the sequence of the state after the step. Resolves to undefined if it was stopped, or if the daemon refuses, which a
 * message reports.
 */
export async function stepAndSee(steps: number, stop: AbortSignal): Promise<bigint | undefined> {
  const cut = new AbortController();
  const cutLater = () => setTimeout(() => cut.abort(), GRACE);
  stop.addEventListener("abort", cutLater);
  if (stop.aborted) cutLater();
  try {
    const { stamp } = await services().simulation.stepSimulation({ steps: BigInt(steps) }, { signal: cut.signal });
    daemonConnection().pollAllNow();
    return stamp?.sequence;
  } catch (error) {
    if (!stop.aborted) toast("error", messageOf(error));
    return undefined;
  } finally {
    stop.removeEventListener("abort", cutLater);
  }
}
