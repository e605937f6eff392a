// Constraints in the page: drawn at the daemon's positions, with their force, and removed.

import { expect, test } from "vitest";

import { ConstraintKind } from "../src/gen/simd/v1/constraint_pb";
import { Base } from "../src/gen/simd/v1/entity_pb";
import { SimulationState } from "../src/gen/simd/v1/simulation_pb";
import { Tab } from "./browser";
import { Daemon } from "./daemon";
import { fixtures } from "./fixtures";

const use = fixtures();

test("a rope and a weld are drawn between their anchors, say their force, and can be removed", async () => {
  const daemon = await use.daemon(Daemon.demo());
  const box = { geometry: { case: "box", value: { size: { x: 0.2, y: 0.2, z: 0.2 } } }, mass: 2 } as const;
  // Nothing may fall before it hangs on the rope.
  await daemon.simulation.setSimulationState({ state: SimulationState.PAUSED });
  // One below the other, so that nothing swings.
  for (const [name, z] of [["load", 1], ["tool", 0.7]] as const) {
    await daemon.entities.spawnEntity({ name, base: Base.FREE, pose: { position: { x: 0.5, y: 0.4, z } }, source: { source: { case: "primitive", value: box } } });
  }
  const hook = { pose: { position: { x: 0.5, y: 0.4, z: 1.5 } } };
  await daemon.constraints.createConstraint({ name: "rope", kind: ConstraintKind.DISTANCE, rope: true, parent: hook, child: { robot: "load" } });
  await daemon.constraints.createConstraint({ name: "grip", kind: ConstraintKind.WELD, parent: { robot: "load" }, child: { robot: "tool" } });
  await daemon.simulation.setSimulationState({ state: SimulationState.PLAYING });
  const tab = await Tab.open(await use.context(), daemon.url);
  const drawn = (name: string) => tab.page.evaluate((it) => window.simd.constraint(it), name);
  await tab.page.getByTestId("constraint-rope").waitFor();
  expect((await tab.page.getByTestId("constraint-rope").textContent()) ?? "").toContain("rope: the world to load/");
  const force = (name: string) => tab.page.getByTestId(`constraint-${name}`).getByTestId("constraint-force").textContent();
  // Two boxes of 2 kg hang on it once they are at rest.
  await expect.poll(async () => Math.abs(Number.parseFloat((await force("rope")) ?? "") - 4 * 9.80665), { timeout: 120_000 }).toBeLessThan(0.6);
  const state = (await daemon.simulation.getSimulationState({})).stamp;
  await tab.caughtUp(state?.sequence ?? 0n);
  const [parent, child] = (await drawn("rope")) ?? [[], []];
  expect(parent).toEqual([0.5, 0.4, 1.5]);
  const { entity } = await daemon.entities.getEntityInfo({ robot: "load" });
  const pose = await daemon.linkPose("load", entity?.links[0]?.name ?? "");
  child.forEach((value, index) => expect(Math.abs(value - (pose[index] ?? NaN))).toBeLessThan(0.05));
  await tab.page.getByTestId("constraint-grip").hover();
  await tab.picture("constraints");
  expect(await tab.violations()).toEqual([]);

  await tab.page.getByTestId("constraint-grip").getByTestId("remove-constraint").click();
  await tab.page.getByTestId("remove-surely").click();
  await tab.page.getByTestId("constraint-grip").waitFor({ state: "detached" });
  expect((await daemon.constraints.listConstraints({})).constraints.map(({ name }) => name)).toEqual(["rope"]);
  await expect.poll(() => drawn("grip")).toBeUndefined();
  expect(await drawn("rope")).toBeDefined();
  await tab.page.keyboard.press("l");
  await expect.poll(() => drawn("rope")).toBeUndefined();
  // The list of events contains it.
  await tab.page.getByTestId("clients").click();
  await expect.poll(() => tab.page.getByTestId("happenings").textContent()).toContain("The constraint grip was removed");
  expect(tab.consoleMessages).toEqual([]);
});
