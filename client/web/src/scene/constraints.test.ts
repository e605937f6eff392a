// Drawing of constraints.
import { Matrix4 } from "three";
import { expect, test } from "vitest";
import { MAX_DRAWN, type Constraint } from "../state/constraints";
import { ConstraintMarks, type Finder } from "./constraints";

/** The joints of the parent and the child are two metres apart. */
const find: Finder = ({ robot }) => new Matrix4().makeTranslation(robot === "first" ? 0 : 2, 0, 1);

function of(name: string, changes: Partial<Constraint> = {}): Constraint {
  const end = (robot: string) => ({ robot, link: "arm", joint: "", pose: [0, 0, 0, 0, 0, 0, 1] as const });
  return {
    name,
    kind: "weld",
    parent: end("first"),
    child: end("second"),
    force: [0, 0, 0],
    torque: [0, 0, 0],
    point: [1, 0, 1],
    positionError: 0,
    angleError: 0,
    maxForce: Infinity,
    saturated: false,
    ...changes,
  };
}

function drawn(constraints: readonly Constraint[]): ReturnType<ConstraintMarks["drawn"]> {
  const marks = new ConstraintMarks();
  marks.set(constraints, find, "", 1, 10);
  const found = marks.drawn();
  marks.dispose();
  return found;
}

test("a weld is a line and an arrow for its force, with any torque", () => {
  expect(drawn([of("weld", { force: [0, 0, 5], torque: [0, 5, 0] })])).toEqual({ lines: 1, shafts: 1, heads: 1 });
  expect(drawn([of("weld", { torque: [0, 5, 0] })])).toEqual({ lines: 1, shafts: 0, heads: 0 });
});

test("a gear is a dashed line, and its torque an arrow with two heads", () => {
  expect(drawn([of("gear", { kind: "gear", torque: [0, 5, 0] })])).toEqual({ lines: 7, shafts: 1, heads: 2 });
  // Between joints that slide it is a force.
  expect(drawn([of("gear", { kind: "gear", force: [0, 0, 5] })])).toEqual({ lines: 7, shafts: 1, heads: 1 });
  expect(drawn([of("gear", { kind: "gear" })])).toEqual({ lines: 7, shafts: 0, heads: 0 });
});

test("the first 400 are drawn", () => {
  const marks = new ConstraintMarks();
  const many = Array.from({ length: MAX_DRAWN + 5 }, (_, index) => of(`gear-${index}`, { kind: "gear", torque: [0, 5, 0] }));
  marks.set(many, find, "", 1, 10);
  expect(marks.drawn()).toEqual({ lines: 7 * MAX_DRAWN, shafts: MAX_DRAWN, heads: 2 * MAX_DRAWN });
  expect([MAX_DRAWN - 1, MAX_DRAWN].map((index) => marks.anchors.has(`gear-${index}`))).toEqual([true, false]);
  marks.set([], find, "", 1, 10);
  expect(marks.drawn()).toEqual({ lines: 0, shafts: 0, heads: 0 });
  marks.dispose();
});
