// Sensors in the page: the panel's robot, with their newest reading.

import { expect, test } from "vitest";

import { Base } from "../src/gen/simd/v1/entity_pb";
import { Tab } from "./browser";
import { Daemon } from "./daemon";
import { fixtures } from "./fixtures";

const use = fixtures();

test("the sensors of a robot are listed with what they measured last, as they come and go", async () => {
  const daemon = await use.daemon(Daemon.demo());
  const wall = { geometry: { case: "box", value: { size: { x: 1, y: 4, z: 4 } } }, mass: 1 } as const;
  await daemon.entities.spawnEntity({ name: "wall", base: Base.FIXED, pose: { position: { x: 3, z: 1 } }, source: { source: { case: "primitive", value: wall } } });
  const { entities } = await daemon.entities.listEntities({});
  const robot = entities.find(({ name }) => name !== "wall")?.name ?? "";
  const pose = { position: { x: 0.5, z: 2 } };
  await daemon.sensors.createSensor({ sensor: { robot, name: "imu", kind: { case: "imu", value: {} } } });
  await daemon.sensors.createSensor({ sensor: { robot, name: "eye", rate: 10, pose, kind: { case: "range", value: { min: 0, max: 10 } } } });
  await daemon.sensors.createSensor({ sensor: { robot: "wall", name: "other", kind: { case: "linkState", value: {} } } });
  const tab = await Tab.open(await use.context(), daemon.url);
  await tab.page.getByTestId(`robot-${robot}`).click();
  const reading = (name: string) => tab.page.getByTestId(`sensor-${name}`).getByTestId("sensor-reading").textContent();
  await expect.poll(() => reading("imu")).toContain("9.8");
  await expect.poll(() => reading("eye")).toContain(" m");
  expect(await tab.page.getByTestId("sensor-eye").textContent()).toContain("10 Hz");
  expect(await tab.page.getByTestId("sensor-other").count()).toBe(0);
  await tab.picture("sensors");
  await daemon.sensors.deleteSensor({ robot, name: "imu" });
  await tab.page.getByTestId("sensor-imu").waitFor({ state: "detached" });
  await tab.page.getByTestId("robot-wall").click();
  await expect.poll(() => reading("other")).toContain("at 3 0 1 m");
  await tab.page.getByTestId("clients").click();
  await expect.poll(() => tab.page.getByTestId("happenings").textContent()).toContain(`The sensor imu of ${robot} was removed`);
  expect(await tab.violations()).toEqual([]);
  expect(tab.consoleMessages).toEqual([]);
});
