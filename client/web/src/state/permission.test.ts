// The reason names the client whose claim, or the token whose role, forbids an action.
import { beforeEach, expect, test } from "vitest";
import { ownName, whyNotAll, whyNotChange, whyNotJoint, whyNotRemove, whyNotRobot, whyNotStep, whyNotWorld } from "./permission";
import { robots, role, simulation, type Robot } from "./world";

const arm: Robot = { name: "arm", model: "arm", layoutVersion: 1n, axes: [], links: ["base"], disabledReason: "", claimedBy: "", mass: 1 };

beforeEach(() => {
  ownName.value = "viewer-0001";
  role.value = null;
  robots.value = [arm];
  simulation.value = { ...simulation.value, claimedBy: "" };
});

test("without tokens and claims everything may be changed", () => {
  expect([whyNotChange.value, whyNotRobot(arm), whyNotStep.value, whyNotWorld.value]).toEqual(["", "", "", ""]);
});

test("a viewer sees which role a change takes", () => {
  role.value = "viewer";
  for (const why of [whyNotChange.value, whyNotRobot(arm)]) expect(why).toContain("operator");
  for (const why of [whyNotAll.value, whyNotRemove(arm), whyNotStep.value, whyNotWorld.value]) expect(why).toContain("admin");
});

test("an operator moves robots, and is refused what concerns all", () => {
  role.value = "operator";
  expect([whyNotChange.value, whyNotRobot(arm), whyNotJoint({ label: "elbow", claimedBy: "" })]).toEqual(["", "", ""]);
  for (const why of [whyNotAll.value, whyNotRemove(arm), whyNotStep.value, whyNotWorld.value]) expect(why).toContain("the role operator; this needs the role admin");
});

test("another's claim names its holder and what is claimed, and an own claim forbids nothing", () => {
  expect(whyNotRobot({ ...arm, claimedBy: "anna" })).toMatch(/^anna has claimed arm/);
  expect(whyNotJoint({ label: "elbow", claimedBy: "anna" })).toMatch(/^anna has claimed elbow/);
  expect(whyNotRobot({ ...arm, claimedBy: "viewer-0001" })).toBe("");
  simulation.value = { ...simulation.value, claimedBy: "anna" };
  expect(whyNotStep.value).toMatch(/^anna has claimed the world/);
  expect(whyNotWorld.value).toBe(whyNotStep.value);
});

test("while another has claimed a robot the world may be stepped, and played by who claims it", () => {
  robots.value = [{ ...arm, claimedBy: "anna" }];
  expect(whyNotStep.value).toBe("");
  expect(whyNotWorld.value).toContain("anna has claimed arm");
  simulation.value = { ...simulation.value, claimedBy: "viewer-0001" };
  expect(whyNotWorld.value).toBe("");
});
