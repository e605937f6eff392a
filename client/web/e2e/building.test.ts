// Building a world in the page: shapes, robots with options, moves by handles and numbers, duplicates, and undo. One question
// precedes changes that concern all clients.

import { mkdir, mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { dirname, resolve } from "node:path";

import { expect, test } from "vitest";

import { Base } from "../src/gen/simd/v1/entity_pb";
import { SimulationState } from "../src/gen/simd/v1/simulation_pb";
import { inSight, savedFile, Tab } from "./browser";
import { Daemon, REPOSITORY } from "./daemon";
import { fixtures } from "./fixtures";

const use = fixtures();

const names = async (daemon: Daemon): Promise<string[]> => (await daemon.entities.listEntities({})).entities.map(({ name }) => name);

async function paused(): Promise<Daemon> {
  const daemon = await use.daemon(Daemon.start(["--gravity", "0,0,0"]));
  await daemon.simulation.setSimulationState({ state: SimulationState.PAUSED });
  return daemon;
}

/** A red box of 0.4 m with its centre here. */
async function redBox(daemon: Daemon, name: string, x = 0, y = 0, z = 0.5): Promise<void> {
  const primitive = { geometry: { case: "box", value: { size: { x: 0.4, y: 0.4, z: 0.4 } } }, mass: 1, color: { red: 1, green: 0, blue: 0, alpha: 1 } } as const;
  await daemon.entities.spawnEntity({ name, base: Base.FREE, pose: { position: { x, y, z } }, source: { source: { case: "primitive", value: primitive } } });
}

async function open(tab: Tab, item: string): Promise<void> {
  await tab.page.getByTestId("build").click();
  await tab.page.getByTestId(item).click();
}

test("a shape is added by a form, and undone and redone by keys", async () => {
  const daemon = await paused();
  const tab = await Tab.open(await use.context(), daemon.url);
  await open(tab, "build-add");
  await tab.page.getByTestId("add-kind").selectOption("cylinder");
  await tab.page.getByTestId("build-name").fill("drum");
  await tab.page.getByTestId("add-radius").fill("15 cm");
  await tab.page.getByTestId("add-x").fill("0.5 + 0.25");
  await tab.page.getByTestId("add-mass").fill("3");
  expect(await tab.violations()).toEqual([]);
  await tab.picture("build-add");
  await tab.page.getByTestId("add-now").click();
  await expect.poll(() => names(daemon)).toEqual(["drum"]);
  const [{ entity }, { pose }] = [await daemon.entities.getEntityInfo({ robot: "drum" }), await daemon.entities.getEntityState({ robot: "drum" })];
  expect(entity?.mass).toBeCloseTo(3, 9);
  expect(pose?.position?.x).toBeCloseTo(0.75, 9);
  await tab.page.getByTestId("add-sheet").waitFor({ state: "detached" });
  await tab.page.keyboard.press("Control+z");
  await expect.poll(() => names(daemon)).toEqual([]);
  await tab.page.keyboard.press("Control+Shift+z");
  await expect.poll(() => names(daemon)).toEqual(["drum"]);
});

test("undo does not touch another client's robot with the same name", async () => {
  const daemon = await paused();
  const tab = await Tab.open(await use.context(), daemon.url);
  await open(tab, "build-add");
  await tab.page.getByTestId("build-name").click();
  await tab.page.keyboard.type("crate");
  await tab.page.keyboard.press("Enter");
  await expect.poll(() => names(daemon)).toEqual(["crate"]);
  await tab.page.getByTestId("add-sheet").waitFor({ state: "detached" });
  await daemon.entities.deleteEntity({ robot: "crate" });
  await redBox(daemon, "crate", 1);
  await tab.page.keyboard.press("Control+z");
  await expect.poll(async () => (await tab.page.getByTestId("toast").allTextContents()).join()).toContain("Another robot now has the name crate");
  expect(await names(daemon)).toEqual(["crate"]);
});

test("an invalid number is reported at its field", async () => {
  const daemon = await paused();
  await redBox(daemon, "crate");
  const tab = await Tab.open(await use.context(), daemon.url);
  await open(tab, "build-add");
  await tab.page.getByTestId("add-size-0").fill("-1");
  await tab.page.getByTestId("add-now").click();
  expect(await inSight(tab.page, "add-problem")).toContain("longer than 0");
  await tab.page.getByTestId("add-size-0").fill("3 kg");
  expect(await tab.page.getByTestId("add-size-0").getAttribute("aria-invalid")).toBe("true");
  expect(await names(daemon)).toEqual(["crate"]);
});

test("a height field from a file is ground", async () => {
  const daemon = await paused();
  await redBox(daemon, "crate");
  const tab = await Tab.open(await use.context(), daemon.url);
  const folder = await mkdtemp(`${tmpdir()}/simd-heights-`);
  await writeFile(`${folder}/hills.csv`, "0,0,0\n0,0.5,0\n0,0,0\n");
  await open(tab, "build-add");
  await tab.page.getByTestId("add-kind").selectOption("heights");
  await tab.page.getByTestId("add-heights").setInputFiles(`${folder}/hills.csv`);
  await tab.page.getByTestId("add-now").click();
  await expect.poll(() => names(daemon)).toEqual(["crate", "ground"]);
  // The peak is 0.5 of 2 m high, above the box.
  const { hits } = await daemon.contacts.castRays({ rays: [{ from: { x: 0, y: 0, z: 5 }, to: { x: 0, y: 0, z: -5 } }] });
  expect(hits[0]?.robot).toBe("ground");
  expect(hits[0]?.point?.z).toBeCloseTo(1, 6);
});

test("a chosen robot gets a name, a place, a free base and hulls", async () => {
  const daemon = await paused();
  const tab = await Tab.open(await use.context(), daemon.url);
  await tab.page.getByTestId("folder-input").first().setInputFiles(resolve(REPOSITORY, "tests/assets/Two Link.v2"));
  await tab.page.getByTestId("load-sheet").waitFor();
  expect(await tab.page.getByTestId("load-found").textContent()).toContain(".urdf");
  await tab.page.getByTestId("build-name").fill("left");
  await tab.page.getByTestId("load-x").fill("1.5");
  await tab.page.getByTestId("load-z").fill("2");
  await tab.page.getByTestId("load-yaw").fill("90");
  await tab.page.getByTestId("load-base").selectOption("free");
  await tab.page.getByTestId("load-meshes").selectOption("hull");
  expect(await tab.violations()).toEqual([]);
  await tab.picture("load-sheet");
  await tab.page.getByTestId("load-now").click();
  await expect.poll(() => names(daemon)).toEqual(["left"]);
  const [{ entity }, { pose }] = [await daemon.entities.getEntityInfo({ robot: "left" }), await daemon.entities.getEntityState({ robot: "left" })];
  expect(entity?.base).toBe(Base.FREE);
  expect([pose?.position?.x, pose?.position?.z]).toEqual([1.5, 2]);
  expect(pose?.orientation?.z).toBeCloseTo(Math.SQRT1_2, 9);
  // Duplicated with the same options, and removed and restored.
  await open(tab, "build-duplicate");
  await expect.poll(() => names(daemon)).toEqual(["left", "left_1"]);
  expect((await daemon.entities.getEntityInfo({ robot: "left_1" })).entity?.base).toBe(Base.FREE);
  await tab.page.keyboard.press("Control+z");
  await expect.poll(() => names(daemon)).toEqual(["left"]);
});

test("a package of xacro is expanded with its arguments, and its meshes are found", async () => {
  const daemon = await paused();
  const tab = await Tab.open(await use.context(), daemon.url);
  const folder = await mkdtemp(`${tmpdir()}/simd-xacro-`);
  try {
    const write = async (path: string, text: string | Buffer): Promise<void> => {
      await mkdir(dirname(`${folder}/${path}`), { recursive: true });
      await writeFile(`${folder}/${path}`, text);
    };
    const root = (content: string): string => `<robot name="$(arg name)" xmlns:xacro="http://ros.org/wiki/xacro">${content}</robot>`;
    await write("package.xml", "<package><name>my_arm</name></package>");
    await write("launch/show.xml", "<launch/>");
    await write("config/sizes.yaml", "reach: 0.25\n");
    await write("urdf/parts.xacro", root(`<xacro:macro name="hand" params="reach"><link name="hand"/><joint name="slide" type="prismatic"><parent link="base"/><child link="hand"/><axis xyz="0 0 1"/><limit lower="0" upper="\${reach}" effort="10" velocity="1"/></joint></xacro:macro>`));
    await write(
      "urdf/arm.urdf.xacro",
      root(
        `<xacro:arg name="name" default="arm"/><xacro:arg name="factor"/><xacro:include filename="$(find my_arm)/urdf/parts.xacro"/>` +
          `<xacro:property name="sizes" value="\${xacro.load_yaml('$(find my_arm)/config/sizes.yaml')}"/>` +
          `<link name="base"><visual><geometry><mesh filename="package://my_arm/meshes/part.STL"/></geometry></visual></link><xacro:hand reach="\${sizes['reach'] * $(arg factor)}"/>`,
      ),
    );
    await write("meshes/part.STL", await readFile(resolve(REPOSITORY, "tests/assets/Bench_Arm-1.2 rev B/meshes/arm.STL")));
    await tab.page.getByTestId("folder-input").first().setInputFiles(folder);
    await tab.page.getByTestId("load-arg-factor").waitFor();
    expect(await tab.page.getByTestId("load-choice").filter({ has: tab.page.locator(":checked") }).textContent()).toBe("arm.urdf.xacroxacro");
    expect(await tab.page.getByTestId("load-arg-name").getAttribute("placeholder")).toBe("arm");
    expect(await tab.violations()).toEqual([]);
    // An argument without a default is required.
    await tab.page.getByTestId("load-now").click();
    expect(await tab.page.getByTestId("load-sheet").isVisible()).toBe(true);
    await tab.page.getByTestId("load-arg-name").fill("lift");
    await tab.page.getByTestId("load-arg-factor").fill("2");
    await tab.picture("load-xacro");
    await tab.page.getByTestId("load-now").click();
    await expect.poll(() => names(daemon)).toEqual(["lift"]);
    const { layout } = await daemon.joints.getJointLayout({ robot: "lift" });
    expect(layout?.joints.find(({ name }) => name === "slide")?.limits?.upper).toBeCloseTo(0.5, 12);
    // The page learns of the robot after the daemon's other clients.
    await expect.poll(() => tab.requests.filter(({ pathname }) => pathname.startsWith("/meshes/")).length).toBe(1);
    await tab.page.waitForFunction(() => window.simd.settled());
    expect(tab.consoleMessages).toEqual([]);
  } finally {
    await rm(folder, { recursive: true });
  }
});

test("an error in a xacro is reported with its file and line", async () => {
  const daemon = await paused();
  await redBox(daemon, "crate");
  const tab = await Tab.open(await use.context(), daemon.url);
  const folder = await mkdtemp(`${tmpdir()}/simd-xacro-`);
  await writeFile(`${folder}/arm.urdf.xacro`, "<robot name='arm'>\n<link name='${unknown}'/></robot>");
  await tab.page.getByTestId("folder-input").first().setInputFiles(folder);
  await tab.page.getByTestId("load-now").click();
  await expect.poll(async () => (await tab.page.getByTestId("toast").allTextContents()).join()).toMatch(/arm\.urdf\.xacro:2: .*unknown/);
  expect(await names(daemon)).toEqual(["crate"]);
  await rm(folder, { recursive: true });
});

test("a robot is moved by its handles and by numbers, and returns by undo", async () => {
  const daemon = await paused();
  await redBox(daemon, "crate");
  const tab = await Tab.open(await use.context(), daemon.url);
  const at = async (): Promise<number[]> => {
    const { position } = (await daemon.entities.getEntityState({ robot: "crate" })).pose ?? {};
    return [position?.x ?? NaN, position?.y ?? NaN, position?.z ?? NaN];
  };
  await open(tab, "build-place");
  await tab.page.getByTestId("place-card").waitFor();
  expect(await tab.violations()).toEqual([]);
  await tab.page.getByTestId("place-y").fill("0.25");
  await tab.page.keyboard.press("Enter");
  await expect.poll(at).toEqual([0, 0.25, 0.5]);
  // The handle along x is three's: it begins at the centre and ends at half of this size.
  await tab.shows(daemon);
  const [from, to] = await tab.page.evaluate(() => {
    const [cx = 0, cy = 0, cz = 0] = window.simd.camera.position();
    const size = (Math.hypot(cx, cy - 0.25, cz - 0.5) * 1.9 * Math.tan((19 * Math.PI) / 180)) / 4;
    return [window.simd.project([0.4 * size, 0.25, 0.5]), window.simd.project([0.4 * size + 0.5, 0.25, 0.5])] as const;
  });
  await tab.onHandle(from);
  await tab.page.mouse.down();
  await tab.page.mouse.move(to.x, to.y, { steps: 8 });
  await tab.page.mouse.up();
  const along = async () => {
    const [x = 0, y, z] = await at();
    return [x > 0.3 && x < 0.7, y, z];
  };
  await expect.poll(along).toEqual([true, 0.25, 0.5]);
  await tab.picture("placed");
  await tab.page.keyboard.press("Control+z");
  await expect.poll(async () => (await at())[0]).toBeCloseTo(0, 6);
  await tab.page.keyboard.press("Escape");
  await tab.page.getByTestId("place-card").waitFor({ state: "detached" });
});

test("a number of the card moves a robot when it is entered or left, not with each key, and arrows at once", async () => {
  const daemon = await paused();
  await redBox(daemon, "crate", 0, 0, 1.5);
  const tab = await Tab.open(await use.context(), daemon.url);
  const at = async (): Promise<number[]> => {
    const { position } = (await daemon.entities.getEntityState({ robot: "crate" })).pose ?? {};
    return [position?.x ?? NaN, position?.y ?? NaN, position?.z ?? NaN];
  };
  const moves = (): number => tab.requests.filter(({ pathname }) => pathname.endsWith("/SetEntityState")).length;
  const type = async (axis: string, text: string): Promise<void> => {
    await tab.page.getByTestId(`place-${axis}`).click();
    await tab.page.keyboard.press("Control+a");
    await tab.page.keyboard.type(text);
  };
  await open(tab, "build-place");
  await tab.page.getByTestId("place-card").waitFor();
  // Typing passes through 0, which is in the ground.
  await type("z", "0.8");
  expect([await at(), moves()]).toEqual([[0, 0, 1.5], 0]);
  await tab.page.keyboard.press("Enter");
  await expect.poll(at).toEqual([0, 0, 0.8]);
  await type("y", "-0.5");
  await tab.page.keyboard.press("Tab");
  await expect.poll(at).toEqual([0, -0.5, 0.8]);
  // The browser reports a request after the daemon has received it.
  await expect.poll(moves).toBe(2);
  // The first Escape restores the old number, the second closes the card.
  await type("y", "7");
  await tab.page.keyboard.press("Escape");
  await expect.poll(() => tab.page.getByTestId("place-y").inputValue()).toBe("-0.5");
  // Text that cannot be read gives a message, and nothing moves.
  await type("x", "far");
  await tab.page.keyboard.press("Enter");
  await expect.poll(() => tab.page.getByTestId("place-x").getAttribute("aria-invalid")).toBe("true");
  await tab.page.keyboard.press("Escape");
  expect([await at(), moves()]).toEqual([[0, -0.5, 0.8], 2]);
  for (let presses = 0; presses < 5; presses += 1) await tab.page.keyboard.press("ArrowUp");
  await expect.poll(async () => (await at())[0]).toBeCloseTo(0.05, 9);
  await tab.page.keyboard.press("Escape");
  await tab.page.getByTestId("place-card").waitFor({ state: "detached" });
});

test("a number that is selected stays selected while the robot moves, so that a typed one replaces it", async () => {
  const daemon = await use.daemon(Daemon.start(["--gravity", "0,0,0"]));
  await redBox(daemon, "crate");
  const tab = await Tab.open(await use.context(), daemon.url);
  await open(tab, "build-place");
  const field = tab.page.getByTestId("place-x");
  await field.waitFor();
  await daemon.entities.setEntityState({ robot: "crate", twist: { linear: { x: 0.1 } } });
  await field.click();
  await tab.page.keyboard.press("Control+a");
  const before = await field.inputValue();
  await expect.poll(() => field.inputValue()).not.toBe(before);
  await tab.page.keyboard.type("-2");
  await tab.page.keyboard.press("Enter");
  const x = async () => (await daemon.entities.getEntityState({ robot: "crate" })).pose?.position?.x;
  await expect.poll(x).toBe(-2);
});

test("the end of an arm is brought to a place by its joints, in a paused world and by targets in one that plays", async () => {
  const daemon = await paused();
  const tab = await Tab.open(await use.context(), daemon.url);
  await tab.page.getByTestId("add-demo-arm").click();
  await expect.poll(() => tab.page.getByTestId("slider").count()).toBeGreaterThan(3);
  const [robot = ""] = await names(daemon);
  const { layout } = await daemon.joints.getJointLayout({ robot });
  const tip = layout?.joints.filter(({ limits, mimic }) => limits !== undefined && !mimic).at(-2)?.childLink ?? "";
  await open(tab, "build-place");
  await tab.page.getByTestId("place-part").selectOption(`link ${tip}`);
  const place = async () => (await daemon.linkPose(robot, tip)).slice(0, 3);
  const [x = 0, y = 0, z = 0] = await place();
  // The card shows the robot until the choice of the link is drawn.
  await expect.poll(async () => Number(await tab.page.getByTestId("place-z").inputValue())).toBeCloseTo(z, 4);
  await tab.page.getByTestId("place-z").fill(String(z - 0.05));
  await tab.page.keyboard.press("Enter");
  const off = async (from: number[]) => Math.hypot(...(await place()).map((value, axis) => value - (from[axis] ?? NaN)));
  await expect.poll(() => off([x, y, z - 0.05])).toBeLessThan(5e-3);
  await daemon.simulation.setSimulationState({ state: SimulationState.PLAYING });
  await tab.page.getByTestId("place-z").fill(String(z - 0.02));
  await tab.page.keyboard.press("Enter");
  // A failure shows what the page says and what its field holds.
  const now = async () => ({ z: (await place())[2], field: await tab.page.getByTestId("place-z").inputValue(), toasts: await tab.page.getByTestId("toast").allTextContents() });
  await expect.poll(now).toMatchObject({ z: expect.closeTo(z - 0.02, 2) });
});

test("one question that says who else is here comes before a reset", async () => {
  const daemon = await paused();
  await redBox(daemon, "crate");
  const [one, other] = [await Tab.open(await use.context(), daemon.url), await Tab.open(await use.context(), daemon.url)];
  await daemon.entities.setEntityState({ robot: "crate", pose: { position: { x: 2, y: 0, z: 1 } } });
  const x = async () => (await daemon.entities.getEntityState({ robot: "crate" })).pose?.position?.x;
  // This test's client and both pages.
  daemon.stays();
  await expect.poll(() => one.page.getByTestId("clients").textContent()).toMatch(/^[3-9] connected/);
  await one.page.keyboard.press("Backspace");
  await expect.poll(() => one.page.getByTestId("ask-others").textContent()).toMatch(/viewer-[0-9a-f]{4}/);
  expect(await one.violations()).toEqual([]);
  await one.page.getByTestId("ask-not").click();
  expect(await x()).toBe(2);
  await one.page.getByTestId("reset").click();
  await one.page.getByTestId("ask-surely").click();
  await expect.poll(x).toBe(0);
  await other.page.close();
});

test("a hundred robots are drawn by few calls, and are a short list: groups, a filter, and what is hidden on this page", async () => {
  const daemon = await paused();
  for (let index = 0; index < 100; index += 1) await redBox(daemon, `crate_${index}`, (index % 10) * 0.6, Math.floor(index / 10) * 0.6);
  await redBox(daemon, "single", 0, -2);
  const tab = await Tab.open(await use.context(), daemon.url);
  const calls = () => tab.page.evaluate(() => window.simd.stats.calls());
  expect(await calls()).toBeLessThan(15);
  // The pointer finds each of them, and each can have a separate colour.
  const corner = await tab.project([9 * 0.6, 9 * 0.6, 0.7]);
  await tab.page.mouse.click(corner.x, corner.y);
  await expect.poll(() => tab.page.getByTestId("robot-crate_99").getAttribute("aria-selected")).toBe("true");
  await tab.page.mouse.move(5, 5);
  await daemon.view.setLinkColors({ colors: [{ robot: "crate_99", link: "link", color: { red: 0, green: 0.2, blue: 1, alpha: 1 } }] });
  const near = { left: corner.x - 3, right: corner.x + 3, top: corner.y - 3, bottom: corner.y + 3 };
  await expect.poll(async () => (await tab.seen(near, -30, 30)).pixels).toBe(0);
  await daemon.view.setLinkColors({ colors: [{ robot: "crate_99", link: "link" }] });
  await expect.poll(async () => (await tab.seen(near, -30, 30)).pixels).toBeGreaterThan(0);
  await open(tab, "build-robots");
  const lines = tab.page.locator(".world-lines li");
  const few = async () => {
    const count = await lines.count();
    return count > 10 && count < 45;
  };
  await expect.poll(few).toBe(true);
  expect(await tab.violations()).toEqual([]);
  await tab.page.getByTestId("robots-filter").fill("crate_77");
  await expect.poll(() => lines.count()).toBe(1);
  await tab.page.getByTestId("robots-filter").fill("");
  await tab.page.getByTestId("robots-group-crate").click();
  await expect.poll(() => lines.count()).toBe(2);
  const red = async () => (await tab.seen({ left: 0, right: 1280, top: 60, bottom: 660 }, -30, 30)).pixels;
  await tab.page.getByTestId("robots-eye-crate").click();
  await tab.page.getByTestId("robots-eye-single").click();
  await tab.page.keyboard.press("Escape");
  await tab.page.waitForFunction(() => window.simd.settled());
  await expect.poll(red).toBe(0);
  await open(tab, "build-robots");
  await tab.picture("robots-sheet");
  await tab.page.getByTestId("robots-show-all").click();
  await tab.page.keyboard.press("Escape");
  await expect.poll(red).toBeGreaterThan(100);
});

test("saved states are made, put back, saved as a file, deleted, and taken from the file", async () => {
  const daemon = await paused();
  await redBox(daemon, "crate");
  const tab = await Tab.open(await use.context({ acceptDownloads: true }), daemon.url);
  const x = async () => (await daemon.entities.getEntityState({ robot: "crate" })).pose?.position?.x;
  await open(tab, "build-states");
  await tab.page.getByTestId("state-name").fill("before");
  await tab.page.getByTestId("state-save").click();
  await tab.page.getByTestId("state-before").waitFor();
  expect(await tab.violations()).toEqual([]);
  await tab.picture("states-sheet");
  const [download] = await Promise.all([tab.page.waitForEvent("download"), tab.page.getByTestId("state-download").click()]);
  expect(download.suggestedFilename()).toBe("before.simdstate");
  const file = await savedFile(download);
  await tab.page.getByTestId("state-delete").click();
  await tab.page.getByTestId("state-delete-surely").click();
  await tab.page.getByTestId("state-before").waitFor({ state: "detached" });
  await daemon.entities.setEntityState({ robot: "crate", pose: { position: { x: 3, y: 0, z: 1 } } });
  await tab.page.getByTestId("state-file").setInputFiles(file);
  await tab.page.getByTestId("state-before").waitFor();
  expect(await x()).toBe(3);
  // The question needs another connected client.
  await tab.seesAnother(daemon);
  await tab.page.getByTestId("state-restore").click();
  await tab.page.getByTestId("ask-surely").click();
  await expect.poll(x).toBe(0);
});
