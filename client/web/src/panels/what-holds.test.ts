// A joint that does not move shows the reason, the widest first.
import { expect, test } from "vitest";
import { whatHolds, type Situation } from "./what-holds";

const free: Situation = {
  axis: { label: "elbow", kind: "angle", lower: -1, upper: 1, effortLimit: 20 },
  mode: "position",
  target: 0.5,
  position: 0,
  velocity: 0,
  flags: 0,
  blockedBy: "",
  disabledReason: "",
  world: "playing",
};

test("a joint on its way, and one that has arrived, are held by nothing", () => {
  expect(whatHolds(free)).toBeUndefined();
  expect(whatHolds({ ...free, world: "paused", position: 0.5 })).toBeUndefined();
  expect(whatHolds({ ...free, world: "paused", mode: "passive" })).toBeUndefined();
});

test("a paused world, a limit and a saturated actuator are shown with their numbers", () => {
  expect(whatHolds({ ...free, world: "paused" })?.word).toBe("paused");
  expect(whatHolds({ ...free, world: "stopped", mode: "velocity" })?.word).toBe("stopped");
  expect(whatHolds({ ...free, flags: 4 })).toEqual({ word: "at limit", sentence: "It is at its upper limit, 1 rad" });
  expect(whatHolds({ ...free, flags: 2 })?.sentence).toContain("lower limit, -1 rad");
  expect(whatHolds({ ...free, flags: 1 })?.sentence).toContain("20 N m");
});

test("the blocking link is named, before the effort", () => {
  expect(whatHolds({ ...free, flags: 1, blockedBy: "crate" })).toEqual({
    word: "blocked by crate",
    sentence: "crate blocks it: it touches a link that this joint moves",
  });
});

test("a reason for the whole robot is shown before a reason for one joint", () => {
  const all = { ...free, flags: 7, world: "paused", disabledReason: "its state was not finite" } as const;
  expect(whatHolds(all)).toEqual({ word: "disabled", sentence: "Its robot is disabled: its state was not finite. A reset brings it back" });
  expect(whatHolds({ ...all, disabledReason: "" })?.word).toBe("paused");
  expect(whatHolds({ ...all, disabledReason: "", world: "playing" })?.word).toBe("at limit");
});
