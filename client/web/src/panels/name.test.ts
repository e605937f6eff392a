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
  const letters = { "\u{1f916}": 6, "\u{1f468}\u200d\u{1f469}\u200d\u{1f467}": 6, "e\u0301": 12, क्षि: 12, 한: 6, ж: 12 };
  for (const [letter, count] of Object.entries(letters)) {
    const name = letter.repeat(40);
    const [start, end] = splitName(name);
    expect(start + end).toBe(name);
    expect(end).toBe(letter.repeat(count));
  }
});

test("a name is short by the room that its letters take, which is twice as much in some scripts", () => {
  expect(splitName("plain_name_of_a_joint")).toEqual(["plain_name_of_a_joint", ""]);
  expect(splitName("左手第一关节")).toEqual(["左手第一关节", ""]);
  expect(splitName("机器人左侧夹爪手指远端关节")).toEqual(["机器人左侧夹爪", "手指远端关节"]);
});
