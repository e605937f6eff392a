// Lifts robots that this tab loaded onto the ground, as far as what is drawn of them reaches below their collision shapes.
import { Box3 } from "three";
import { put } from "../daemon/actions";
import { MAX_DEPTH, unmeasured } from "../state/report";
import type { RobotViews } from "./robot-views";
import { isFlatGround } from "./scenery";

/** Lifts the drawn robots that are not measured yet. */
export function liftOntoGround(robots: RobotViews): void {
  const waiting = [...unmeasured.peek()].filter((name) => robots.get(name));
  if (waiting.length === 0) return;
  unmeasured.value = new Set([...unmeasured.peek()].filter((name) => !waiting.includes(name)));
  for (const name of waiting) {
    const view = robots.get(name);
    const box = view?.bounds() ?? new Box3();
    // Ground stays at its description's position.
    if (!view || box.isEmpty() || isFlatGround(view.scene, box) || box.min.z >= -MAX_DEPTH) continue;
    // Box and pose are from one picture. A free robot falls until the daemon answers, and would keep the depth of its fall.
    const [x, y, z, ...turn] = view.drawnPose(0);
    if (x !== undefined && y !== undefined && z !== undefined && isTurn(turn)) void put(name, [x, y, z - box.min.z, ...turn]);
  }
}

function isTurn(numbers: readonly number[]): numbers is [number, number, number, number] {
  return numbers.length === 4;
}
