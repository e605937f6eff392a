// Robots that this tab loaded begin on the ground, which is not part of their description.
import { Box3 } from "three";
import { lift } from "../daemon/actions";
import { unmeasured } from "../state/report";
import type { RobotViews } from "./robot-views";
import { isFlatGround } from "./scenery";

/** Metres that a robot may be below the ground. */
const MAX_DEPTH = 1e-3;

/** Lifts those that are there and have not been measured yet. */
export function liftOntoGround(robots: RobotViews): void {
  const waiting = [...unmeasured.peek()].filter((name) => robots.get(name));
  if (waiting.length === 0) return;
  unmeasured.value = new Set([...unmeasured.peek()].filter((name) => !waiting.includes(name)));
  for (const name of waiting) {
    const view = robots.get(name);
    const box = view?.bounds() ?? new Box3();
    // Ground is where its description puts it.
    const lowest = !view || isFlatGround(view.scene, box) ? 0 : box.min.z;
    if (lowest < -MAX_DEPTH) void lift(name, -lowest);
  }
}
