// Steps of a paused world, one call after the other, for who wants to see each.
import { toast } from "../state/toasts";
import { messageOf } from "./error-message";
import { daemonConnection } from "./page";
import { services } from "./services";

/** Steps the world; resolves to the sequence of the state then, or to undefined where the daemon refuses, which is said. */
export async function stepAndSee(steps: number): Promise<bigint | undefined> {
  try {
    const { stamp } = await services().simulation.stepSimulation({ steps: BigInt(steps) });
    daemonConnection().pollAllNow();
    return stamp?.sequence;
  } catch (error) {
    toast("error", messageOf(error));
    return undefined;
  }
}
