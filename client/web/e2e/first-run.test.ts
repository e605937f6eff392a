// The page over an empty world offers three actions.

import { expect, test } from "vitest";

import { Base } from "../src/gen/simd/v1/entity_pb";
import { demoArm } from "../src/load/demo-arm";
import { Tab } from "./browser";
import { Daemon } from "./daemon";
import { fixtures } from "./fixtures";

const use = fixtures();

test("an empty world explains itself, and gives an arm to move", async () => {
  const daemon = await use.daemon(Daemon.start([]));
  const tab = await Tab.open(await use.context(), daemon.url);
  await tab.page.getByTestId("read-how").click();
  const guide = tab.page.getByTestId("help-sheet");
  await guide.waitFor();
  expect(await guide.textContent()).toContain("simctl robot load");
  expect(await tab.violations()).toEqual([]);
  await tab.picture("guide");
  await tab.page.keyboard.press("Escape");
  await guide.waitFor({ state: "detached" });
  await tab.page.getByTestId("add-demo-arm").click();
  await expect.poll(() => tab.page.getByTestId("slider").count()).toBe(5);
  const { entities } = await daemon.entities.listEntities({});
  const { report } = await daemon.entities.validateDescription({ source: { source: { case: "urdf", value: new TextEncoder().encode(demoArm()) } } });
  expect(entities.map(({ name }) => name)).toEqual(["demo_arm"]);
  expect(report?.findings.filter(({ severity }) => severity > 1).map(({ message }) => message)).toEqual([]);
  // It holds its pose, and moves to its targets, including sums.
  const number = tab.page.getByTestId("number").nth(1);
  await number.fill("2*(0.1 + 0.2)");
  await number.press("Enter");
  await expect.poll(async () => (await daemon.joint("demo_arm", "shoulder")).position).toBeCloseTo(0.6, 1);
  // Its row shows the reason why it does not reach its target.
  const badge = tab.page.getByTestId("badge").nth(1);
  await number.fill("9");
  await number.press("Enter");
  await expect.poll(() => badge.textContent()).toBe("at limit");
  expect(await badge.getAttribute("title")).toMatch(/^It is at its upper limit, [\d.]+ rad$/);
  await tab.page.getByTestId("play").click();
  await number.fill("0");
  await number.press("Enter");
  await expect.poll(() => badge.textContent()).toBe("paused");
  await tab.picture("why-not");
  await tab.page.getByTestId("play").click();
  await expect.poll(() => badge.textContent()).toBe("");
  // A wall in its way, by the daemon's account of contacts.
  const box = { geometry: { case: "box", value: { size: { x: 0.2, y: 1, z: 0.6 } } }, mass: 1 } as const;
  await daemon.entities.spawnEntity({ name: "wall", base: Base.FIXED, pose: { position: { x: 0.4, y: 0, z: 0.5 } }, source: { source: { case: "primitive", value: box } } });
  await number.fill("1.2");
  await number.press("Enter");
  await expect.poll(() => badge.textContent()).toMatch(/^blocked by wall/);
  await tab.picture("why-not-blocked");
  await daemon.entities.deleteEntity({ robot: "wall" });
  await expect.poll(() => badge.textContent()).toBe("");
  await tab.page.waitForFunction(() => window.simd.settled());
  await tab.picture("demo-arm");
  expect(await tab.violations()).toEqual([]);
});
