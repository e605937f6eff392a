// Lifts robots that this tab loaded onto the ground, which is not part of their description.
import { Box3 } from "three";
import { lift } from "../daemon/actions";
import { unmeasured } from "../state/report";
import type { RobotViews } from "./robot-views";
import { isFlatGround } from "./scenery";

/** Tolerance below the ground, metres. */
const MAX_DEPTH = 1e-3;

/** Lifts the drawn robots that are not measured yet. */
export function liftOntoGround(robots: RobotViews): void {
  const waiting = [...unmeasured.peek()].filter((name) => robots.get(name));
  if (waiting.length === 0) return;
  unmeasured.value = new Set([...unmeasured.peek()].filter((name) => !waiting.includes(name)));
  for (const name of waiting) {
    const view = robots.get(name);
    const box = view?.bounds() ?? new Box3();
    // Ground stays at its description's position.
    const lowest = !view || isFlatGround(view.scene, box) ? 0 : box.min.z;
    if (lowest < -MAX_DEPTH) void lift(name, -lowest);
  }
}
