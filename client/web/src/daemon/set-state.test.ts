// The shown state of a world that this page has just let play.
import { expect, test } from "vitest";
import { simulation } from "../state/world";
import { showSetState, statisticsOfRequest } from "./set-state";

test("statistics that were asked for before a change do not take it back, and later ones count", () => {
  const paused = { ...simulation.peek(), state: "paused", overruns: 3n } as const;
  const before = statisticsOfRequest();
  showSetState("playing");
  before(paused);
  expect(simulation.value).toMatchObject({ state: "playing", overruns: 3n });
  statisticsOfRequest()(paused);
  expect(simulation.value.state).toBe("paused");
});
