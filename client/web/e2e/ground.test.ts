// Ground: large fixed things do not decide the first view, and a world without ground offers to add it.

import { expect, test } from "vitest";

import { Base } from "../src/gen/simd/v1/entity_pb";
import { SimulationState } from "../src/gen/simd/v1/simulation_pb";
import { Tab } from "./browser";
import { Daemon } from "./daemon";
import { fixtures } from "./fixtures";

const use = fixtures();

/** Ground of a description: 200 m wide, white, its upper side at z = 0. */
const WIDE = new TextEncoder().encode(
  `<robot name="field"><link name="field">` +
    ["visual", "collision"].map((what) => `<${what}><origin xyz="0 0 -0.01"/><geometry><box size="200 200 0.02"/></geometry>${what === "visual" ? '<material name="white"><color rgba="1 1 1 1"/></material>' : ""}</${what}>`).join("") +
    `</link></robot>`,
);

async function ball(daemon: Daemon, z: number): Promise<void> {
  const shape = { geometry: { case: "sphere", value: { radius: 0.1 } }, color: { red: 0.9, green: 0.2, blue: 0.1, alpha: 1 } } as const;
  await daemon.entities.spawnEntity({ name: "ball", base: Base.FREE, pose: { position: { x: 0.6, y: 0, z } }, source: { source: { case: "primitive", value: shape } } });
}

test("ground of 200 m does not decide the first view", async () => {
  // An arm that sags would change the view.
  const daemon = await use.daemon(Daemon.demo("--paused"));
  const where = (tab: Tab) => tab.page.evaluate(() => [...window.simd.camera.position(), ...window.simd.camera.target()]);
  const expected = await where(await Tab.open(await use.context(), daemon.url));
  await daemon.entities.spawnEntity({ base: Base.FIXED, source: { source: { case: "urdf", value: WIDE } } });
  const tab = await Tab.open(await use.context(), daemon.url);
  (await where(tab)).forEach((value, index) => expect(value).toBeCloseTo(expected[index] ?? Number.NaN, 4));
  // It is solid, so the page offers none.
  expect(await tab.page.getByTestId("add-ground").count()).toBe(0);
  await tab.picture("ground-wide");
});

test("if robots would fall, ground is offered, and holds them", async () => {
  const daemon = await use.daemon(Daemon.start([]));
  await daemon.simulation.setSimulationState({ state: SimulationState.PAUSED });
  await ball(daemon, 0.5);
  const tab = await Tab.open(await use.context(), daemon.url);
  const offer = tab.page.getByTestId("add-ground");
  await offer.waitFor();
  expect(await offer.textContent()).toContain("nothing to stand on");
  await tab.picture("ground-none");
  expect(await tab.violations()).toEqual([]);
  await offer.click();
  await offer.waitFor({ state: "detached" });
  const { entities } = await daemon.entities.listEntities({});
  expect(entities.map(({ name }) => name)).toContain("ground");
  await daemon.simulation.setSimulationState({ state: SimulationState.PLAYING });
  await daemon.pass(2);
  expect((await daemon.linkPose("ball", "link"))[2]).toBeCloseTo(0.1, 2);
  await tab.page.waitForFunction(() => window.simd.settled());
  await tab.picture("ground-added");
});
