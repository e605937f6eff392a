// Steps of a paused world, one call after the other, for who wants to see each.
import { toast } from "../state/toasts";
import { messageOf } from "./error-message";
import { daemonConnection } from "./page";
import { services } from "./services";

/** Milliseconds that a call may still take once it is stopped: mostly the daemon steps in any case, and then what is seen has the step. */
const GRACE = 2000;

/** Steps the world; resolves to the sequence of the state then, or to undefined where it was stopped, or where the daemon refuses, which is said. */
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
