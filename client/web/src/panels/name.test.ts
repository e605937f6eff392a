// Names that are too long keep their ends, in any script.
import { expect, test } from "vitest";
import { splitName } from "./Name";

test("long names that differ at their ends differ in what is never shortened", () => {
  const names = ["left", "right"].map((side) => `robot_assembly_v2_gripper_finger_joint_${side}`);
  const ends = names.map((name) => splitName(name)[1]);
  expect(new Set(ends).size).toBe(2);
  for (const name of [...names, "elbow", "", "L".repeat(100_000)]) expect(splitName(name).join("")).toBe(name);
});

test("a name is not cut within what readers take for a letter", () => {
  for (const letter of ["\u{1f916}", "\u{1f468}\u200d\u{1f469}\u200d\u{1f467}", "e\u0301", "क्षि", "한"]) {
    const name = letter.repeat(40);
    const [start, end] = splitName(name);
    expect(start + end).toBe(name);
    expect(end).toBe(letter.repeat(12));
  }
});
