// Structure of a robot: its tree, names, axes and centres of mass; and how names and text are read.

import { resolve } from "node:path";

import type { Locator } from "playwright-core";
import { expect, test } from "vitest";

import { Base } from "../src/gen/simd/v1/entity_pb";
import { Tab } from "./browser";
import { Daemon, REPOSITORY } from "./daemon";
import { fixtures } from "./fixtures";
import { moved } from "./mesh";

const use = fixtures();

async function humanoid(): Promise<Daemon> {
  const daemon = await use.daemon(Daemon.start(["--asset-root", resolve(REPOSITORY, "tests/assets")]));
  const path = resolve(REPOSITORY, "tests/assets/humanoid/urdf/humanoid.urdf");
  await daemon.entities.spawnEntity({ source: { source: { case: "path", value: path } }, name: "humanoid", base: Base.FIXED, pose: { position: { x: 0, y: 0, z: 1.2 } } });
  return daemon;
}

test("the structure shows each link and joint with its figures", async () => {
  const daemon = await humanoid();
  const tab = await Tab.open(await use.context(), daemon.url);
  await tab.page.keyboard.press("i");
  const { entity } = await daemon.entities.getEntityInfo({ robot: "humanoid" });
  const { layout } = await daemon.joints.getJointLayout({ robot: "humanoid" });
  const links = entity?.links ?? [];
  await tab.page.getByTestId("structure").waitFor();
  expect(await tab.page.locator(".tree > li").count()).toBe(links.length);
  const joint = layout?.joints.find(({ limits }) => limits?.lower !== undefined);
  const row = tab.page.getByTestId(`link-${joint?.childLink}`);
  await row.locator("summary").click();
  const facts = (await row.textContent()) ?? "";
  expect(facts).toContain(joint?.name);
  expect(facts).toMatch(/limits.* to .*rad/);
  expect(facts).toMatch(/centre of mass.* m/);
  expect(facts).toMatch(/inertia xx yy zz.*kg m²/);
  // Its actuator, and the link's appearance.
  const info = layout?.joints.find(({ name }) => name === joint?.name);
  expect(info?.gains?.stiffness).toBeGreaterThan(0);
  await expect.poll(() => row.textContent()).toMatch(/gains[\d.]+.*N m\/rad/);
  expect(facts).toMatch(/looks(box|sphere|cylinder|capsule|mesh)/);
  expect(facts).toMatch(/touches with(box|sphere|cylinder|capsule|convex)/);
  await tab.picture("structure");
  expect(await tab.violations()).toEqual([]);
});

test("holders of claims and readings of sensors are drawn at the robot", async () => {
  const daemon = await humanoid();
  await daemon.sensors.createSensor({ sensor: { robot: "humanoid", name: "balance", rate: 50, kind: { case: "imu", value: {} } } });
  const { layout } = await daemon.joints.getJointLayout({ robot: "humanoid" });
  const joint = layout?.joints.find(({ velocityCount, mimic }) => velocityCount > 0 && !mimic);
  await daemon.joints.claimJoints({ selections: [{ robot: "humanoid", joints: [joint?.name ?? ""] }], holder: "a colleague", lease: 600 });
  const tab = await Tab.open(await use.context(), daemon.url);
  const shown = () => tab.page.locator(".scene-label:not([hidden])").allTextContents();
  await tab.page.getByTestId("toggle-readings").click();
  await expect.poll(async () => (await shown()).join()).toMatch(/balance: .*9\.8.* m\/s²/);
  expect((await shown()).join()).not.toContain("claimed");
  await tab.page.keyboard.press("n");
  await expect.poll(async () => (await shown()).find((text) => text.startsWith(`${joint?.childLink} ·`))).toBe(`${joint?.childLink} · claimed by a colleague`);
  await tab.picture("claims-and-readings");
});

test("centres of mass follow from the masses of the links, and names are next to the links", async () => {
  const daemon = await humanoid();
  const tab = await Tab.open(await use.context(), daemon.url);
  for (const key of ["m", "a", "n"]) await tab.page.keyboard.press(key);
  await tab.page.waitForFunction(() => window.simd.centreOfMass("humanoid") !== undefined);
  const { entity } = await daemon.entities.getEntityInfo({ robot: "humanoid" });
  const links = entity?.links ?? [];
  const { robots } = await daemon.entities.getLinkPoses({ robots: ["humanoid"] });
  const total = links.reduce((sum, { mass }) => sum + mass, 0);
  const mean = [0, 0, 0];
  links.forEach(({ mass, centerOfMass }, index) => {
    const at = moved(robots[0]?.poses.slice(7 * index, 7 * index + 7) ?? [], [centerOfMass?.x ?? 0, centerOfMass?.y ?? 0, centerOfMass?.z ?? 0]);
    at.forEach((value, axis) => (mean[axis] = (mean[axis] ?? 0) + (value * mass) / total));
  });
  const drawn = (await tab.page.evaluate(() => window.simd.centreOfMass("humanoid"))) ?? [];
  drawn.forEach((value, axis) => expect(value).toBeCloseTo(mean[axis] ?? Number.NaN, 2));
  const shown = () => tab.page.locator(".scene-label:not([hidden])").allTextContents();
  await expect.poll(async () => (await shown()).length).toBeGreaterThan(20);
  const names = await shown();
  expect(links.map(({ name }) => name)).toEqual(expect.arrayContaining(names));
  await tab.picture("marks");
});

test("sixty long names can be distinguished: what a filter finds is seen, and the panel can be made wider", async () => {
  const joint = (index: number) =>
    `<link name="l${index}"/><joint name="robot_assembly_v2_gripper_${index < 30 ? "left" : "right"}_finger_distal_phalanx_${index}_joint_revolute" type="continuous"><parent link="base"/><child link="l${index}"/></joint>`;
  const urdf = new TextEncoder().encode(`<robot name="hand"><link name="base"/>${Array.from({ length: 60 }, (_, index) => joint(index)).join("")}</robot>`);
  const daemon = await use.daemon(Daemon.start([]));
  await daemon.entities.spawnEntity({ source: { source: { case: "urdf", value: urdf } }, base: Base.FIXED });
  const tab = await Tab.open(await use.context(), daemon.url);
  await expect.poll(() => tab.page.getByTestId("slider").count()).toBe(60);
  await tab.page.getByTestId("filter").fill("phalanx_47");
  const mark = tab.page.locator(".joint .joint-name mark");
  await expect.poll(() => mark.count()).toBe(1);
  expect(await mark.textContent()).toBe("phalanx_47");
  const [found, panel] = [await mark.boundingBox(), await tab.page.getByTestId("panel").boundingBox()];
  if (found === null || panel === null) throw new Error("the name has no size");
  expect(found.x).toBeGreaterThanOrEqual(panel.x);
  expect(found.x + found.width).toBeLessThanOrEqual(panel.x + panel.width);
  await tab.picture("long-names-filtered");
  await tab.page.getByTestId("filter").fill("");
  const edge = await tab.page.getByTestId("panel-edge").boundingBox();
  if (edge === null) throw new Error("the edge has no size");
  await tab.page.mouse.move(edge.x + edge.width / 2, edge.y + 300);
  await tab.page.mouse.down();
  await tab.page.mouse.move(edge.x - 200, edge.y + 300, { steps: 4 });
  await tab.page.mouse.up();
  const width = async () => (await tab.page.getByTestId("panel").boundingBox())?.width ?? 0;
  expect(await width()).toBeGreaterThan(panel.width + 150);
  // Keys work too, and the setting is kept.
  await tab.page.getByTestId("panel-edge").focus();
  const wide = await width();
  await tab.page.keyboard.press("ArrowRight");
  expect(await width()).toBeCloseTo(wide - 16, 0);
  await tab.page.reload();
  await tab.page.getByTestId("panel").waitFor();
  expect(await width()).toBeCloseTo(wide - 16, 0);
  await tab.picture("long-names-wide");
});

test("text is larger in wide windows, and as the user chooses", async () => {
  const daemon = await use.daemon(Daemon.demo());
  const size = (tab: Tab) => tab.page.locator(".about").first().evaluate((element) => parseFloat(getComputedStyle(element).fontSize));
  const usual = await Tab.open(await use.context(), daemon.url);
  const small = await size(usual);
  const wide = await Tab.open(await use.context({ viewport: { width: 3840, height: 400 } }), daemon.url);
  expect(await size(wide)).toBeCloseTo(1.5 * small, 1);
  await wide.picture("wide-window");
  await usual.page.getByTestId("text-size").click();
  await usual.page.getByTestId("text-size-200").click();
  await expect.poll(() => size(usual)).toBeCloseTo(2 * small, 1);
  const overflow = await usual.page.evaluate(() => document.documentElement.scrollWidth - window.innerWidth);
  expect(overflow).toBeLessThanOrEqual(0);
  expect(await usual.violations()).toEqual([]);
  await usual.picture("text-200");
  // Each menu fits into a low window, and all of it can be reached.
  await usual.page.keyboard.press("Escape");
  const height = 560;
  await usual.page.setViewportSize({ width: 1280, height });
  const menu = usual.page.locator("[popover]:popover-open");
  const isWithin = async (part: Locator): Promise<boolean> => {
    const box = await part.boundingBox();
    return box !== null && box.y >= 0 && box.y + box.height <= height;
  };
  for (const button of ["view-menu", "build", "clients", "text-size", "remove"]) {
    await usual.page.getByTestId(button).click();
    await expect.poll(() => isWithin(menu), { message: button }).toBe(true);
    if (button === "build") {
      const last = usual.page.getByTestId("build-film");
      await last.scrollIntoViewIfNeeded();
      expect(await isWithin(last)).toBe(true);
      await usual.picture("menu-200");
    }
    await usual.page.keyboard.press("Escape");
    await menu.waitFor({ state: "detached" });
  }
});
