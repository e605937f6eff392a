// Words of the panel for constraints.
import { expect, test } from "vitest";
import type { Constraint } from "../state/constraints";
import { meaning, offBy, reading, undrawn } from "./constraint-words";

const END = { robot: "arm", link: "", joint: "elbow", pose: [0, 0, 0, 0, 0, 0, 1] } as const;
const WELD: Constraint = {
  name: "one",
  kind: "weld",
  parent: END,
  child: END,
  force: [0, 3, 4],
  torque: [0, 0, 0.25],
  point: [0, 0, 0],
  positionError: 0,
  angleError: 0,
  maxForce: Infinity,
  saturated: false,
};

test("a note says that only the first 400 are drawn if there are more", () => {
  expect(undrawn(400)).toBe("");
  expect(undrawn(401)).toBe("Only the first 400 of these 401 are drawn.");
});

test("a constraint has its force and its torque", () => {
  expect(reading(WELD)).toBe("5 N · 0.25 N m");
  expect(reading({ ...WELD, maxForce: 20 })).toBe("5 N of 20 N · 0.25 N m");
});

test("a gear has what it does to a joint, in the joint's unit", () => {
  const gear: Constraint = { ...WELD, kind: "gear", force: [0, 0, 0] };
  expect(reading(gear)).toBe("0.25 N m");
  expect(reading({ ...gear, maxForce: 2 })).toBe("0.25 of 2 N m");
  expect(reading({ ...gear, force: [0, 5, 0], torque: [0, 0, 0] })).toBe("5 N");
  expect(reading({ ...gear, torque: [0, 0, 0], maxForce: 2 })).toBe("0 of 2");
  expect(meaning(gear)).not.toBe(meaning(WELD));
});

test("how far a constraint is off has a unit, and a gear that of its joint", () => {
  const off: Constraint = { ...WELD, positionError: 2e-3, angleError: 0.5 };
  expect(offBy(off)).toBe("2 mm and 0.5 rad");
  expect(offBy({ ...off, kind: "gear", force: [0, 0, 0] })).toBe("0.002 rad");
  expect(offBy({ ...off, kind: "gear", torque: [0, 0, 0] })).toBe("2 mm");
});
