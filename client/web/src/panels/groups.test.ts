// Grouping of joints under headings.
import { expect, test } from "vitest";
import { foundIn, grouped, matches } from "./groups";

const shown = (names: string[]): Record<string, string[]> =>
  Object.fromEntries(grouped(names, (name) => name).map(({ heading, rows }) => [heading, rows.map(({ label }) => label)]));

test("a small arm has no headings", () => {
  const names = [1, 2, 3, 4, 5, 6, 7].map((index) => `panda_joint${index}`);
  expect(shown(names)).toEqual({ "": names });
});

test("legs that share a first word are grouped by it", () => {
  const names = ["FL", "FR", "RL", "RR"].flatMap((leg) => ["hip", "thigh", "calf"].map((part) => `${leg}_${part}_joint`));
  const groups = shown(names);
  expect(Object.keys(groups)).toEqual(["FL", "FR", "RL", "RR"]);
  expect(groups["FL"]).toEqual(["hip joint", "thigh joint", "calf joint"]);
});

test("every joint is shown exactly once, those without a group first", () => {
  const side = ["shoulder_pitch", "shoulder_roll", "elbow", "wrist_yaw", "hip_yaw", "knee", "ankle_pitch"];
  const names = ["waist_yaw", "waist_roll", "neck_yaw", "neck_pitch", "tail", ...side.map((n) => `left_${n}`), ...side.map((n) => `right_${n}`)];
  const groups = grouped(names, (name) => name);
  expect(groups.map(({ heading }) => heading)).toEqual(["", "waist", "neck", "left", "right"]);
  expect(groups.flatMap(({ rows }) => rows.map(({ item }) => item)).sort()).toEqual([...names].sort());
});

test("a first word that all names share is not a heading", () => {
  const names = ["left", "right"].flatMap((side) => ["a", "b", "c", "d", "e"].map((part) => `robot_${side}_${part}`));
  expect(Object.keys(shown(names))).toEqual(["left", "right"]);
});

test("names that share nothing stay unchanged", () => {
  const names = Array.from({ length: 12 }, (_, index) => String.fromCharCode(97 + index));
  expect(shown(names)).toEqual({ "": names });
});

test("a filter finds all of its words in any order and any case", () => {
  expect(matches("left_shoulder_pitch", "Pitch left")).toBe(true);
  expect(matches("left_shoulder_pitch", "right")).toBe(false);
  expect(matches("anything", "  ")).toBe(true);
});

test("the match of a filter is marked anywhere in a name, and the name stays whole", () => {
  const marked = (name: string, filter: string) => foundIn(name, filter).map(({ text, found }) => (found ? `[${text}]` : text)).join("");
  expect(marked("left_shoulder_pitch", "PITCH left")).toBe("[left]_shoulder_[pitch]");
  expect(marked("aaa", "aa")).toBe("[aaa]");
  expect(marked("elbow", "  ")).toBe("elbow");
});
