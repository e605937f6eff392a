// The state of the world that this page has set. Statistics that were asked for before may be older, and do not replace it.
import { simulation, type Simulation } from "../state/world";

/** Number of states that this page has set. */
let sets = 0;

/** Shows a state that the daemon has confirmed. */
export function showSetState(state: Simulation["state"]): void {
  sets += 1;
  simulation.value = { ...simulation.peek(), state };
}

/** Returns a function that shows the statistics of a request that is made now. */
export function statisticsOfRequest(): (reported: Simulation) => void {
  const before = sets;
  return (reported) => {
    simulation.value = before === sets ? reported : { ...reported, state: simulation.peek().state };
  };
}
