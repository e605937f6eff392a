// Third-party robots, many joints, and the page of tables, kept as pictures for people.

import { createServer } from "node:http";
import { readFile } from "node:fs/promises";
import { readdirSync } from "node:fs";
import { resolve } from "node:path";

import type { BrowserContext } from "playwright-core";
import { beforeEach, expect, test } from "vitest";

import { Base, MeshShapes } from "../src/gen/simd/v1/entity_pb";
import { Tab } from "./browser";
import { Daemon, REPOSITORY } from "./daemon";
import { fixtures } from "./fixtures";

const use = fixtures();
let context: BrowserContext;
let daemon: Daemon;

beforeEach(async () => {
  context = await use.context();
});

/** The robots of the package `pybullet_data`, which `make test-data` installs. */
function pybulletData(): string {
  const libraries = resolve(REPOSITORY, "target/test-venv/lib");
  const python = readdirSync(libraries).find((name) => name.startsWith("python"));
  return resolve(libraries, python ?? "", "site-packages/pybullet_data");
}

async function load(path: string, more: { base: Base; z?: number; joints?: Record<string, number>; meshShapes?: MeshShapes }): Promise<string> {
  const { entity } = await daemon.entities.spawnEntity({
    source: { source: { case: "path", value: path } },
    base: more.base,
    pose: { position: { x: 0, y: 0, z: more.z ?? 0 } },
    allowRenaming: true,
    jointPositions: more.joints ?? {},
    meshShapes: more.meshShapes ?? MeshShapes.HULL,
  });
  return entity?.name ?? "";
}

async function ground(): Promise<void> {
  const plane = { geometry: { case: "plane", value: {} } } as const;
  await daemon.entities.spawnEntity({ name: "ground", base: Base.FIXED, source: { source: { case: "primitive", value: plane } } });
}

test("an iiwa moves, and its meshes are there", async () => {
  daemon = await use.daemon(Daemon.start(["--asset-root", pybulletData()]));
  const robot = await load(resolve(pybulletData(), "kuka_iiwa/model.urdf"), { base: Base.FIXED });
  const tab = await Tab.open(context, daemon.url);
  await tab.page.getByTestId("plots-toggle").click();
  const meshes = tab.requests.filter((url) => url.pathname.startsWith("/meshes/"));
  expect(meshes.length).toBeGreaterThan(5);
  const goal = { lbr_iiwa_joint_2: 0.6, lbr_iiwa_joint_4: -1.2, lbr_iiwa_joint_6: 0.9 };
  await daemon.aim(robot, goal);
  await expect.poll(async () => (await daemon.joint(robot, "lbr_iiwa_joint_4")).position).toBeCloseTo(-1.2, 2);
  const { states } = await daemon.joints.getJointStates({});
  await tab.caughtUp(states?.stamp?.sequence ?? 0n);
  await tab.picture("iiwa");
});

test("the collision view draws the hulls or convex parts that the daemon has", async () => {
  daemon = await use.daemon(Daemon.start(["--asset-root", resolve(REPOSITORY, "tests/assets")]));
  const urdf = resolve(REPOSITORY, "tests/assets/Bench_Arm-1.2 rev B/urdf/Bench_Arm-1.2 rev B.urdf");
  const hulls = await load(urdf, { base: Base.FIXED });
  const tab = await Tab.open(context, daemon.url);
  const drawn = () => new Set(tab.requests.map((url) => url.pathname).filter((path) => path.startsWith("/colliders/")));
  const served = async (robots: string[]) => {
    const { robots: scenes } = await daemon.entities.getScene({ robots });
    const shapes = scenes.flatMap((scene) => scene.colliders);
    return new Set(shapes.flatMap(({ geometry }) => (geometry.case === "convex" ? [`/colliders/${geometry.value.sha256}.glb`] : [])));
  };
  expect(drawn()).toEqual(new Set());
  await tab.page.getByTestId("toggle-collision").click();
  const ofHulls = await served([hulls]);
  expect(ofHulls.size).toBeGreaterThan(0);
  await expect.poll(drawn).toEqual(ofHulls);
  await load(urdf, { base: Base.FIXED, meshShapes: MeshShapes.DECOMPOSITION });
  const all = await served([]);
  await expect.poll(drawn).toEqual(all);
  await tab.page.waitForFunction(() => window.simd.settled());
  expect(tab.consoleMessages).toEqual([]);
  await tab.picture("colliders");
});

test("the ends of long joint names are seen", async () => {
  const joint = (side: string) =>
    `<link name="${side}"/><joint name="robot_assembly_v2_gripper_finger_distal_joint_${side}" type="continuous"><parent link="base"/><child link="${side}"/></joint>`;
  const urdf = new TextEncoder().encode(`<robot name="hand"><link name="base"/>${joint("left")}${joint("right")}</robot>`);
  daemon = await use.daemon(Daemon.start([]));
  await daemon.entities.spawnEntity({ source: { source: { case: "urdf", value: urdf } } });
  const tab = await Tab.open(context, daemon.url);
  const ends = tab.page.locator(".joint .joint-name .end");
  await expect.poll(() => ends.count()).toBe(2);
  const texts = [];
  for (const end of await ends.all()) {
    const name = await end.locator("xpath=..").boundingBox();
    const box = await end.boundingBox();
    if (box === null || name === null) throw new Error("a name has no size");
    expect(box.x + box.width).toBeLessThanOrEqual(name.x + name.width + 1);
    expect(await end.evaluate((element) => element.scrollWidth - element.clientWidth)).toBeLessThanOrEqual(0);
    texts.push(await end.textContent());
  }
  expect(new Set(texts).size).toBe(2);
});

test("a robot that is looked at while its meshes load is framed as if they had been there", async () => {
  // An arm that sags would change the view.
  daemon = await use.daemon(Daemon.demo("--paused"));
  const fitted = async (tab: Tab) => {
    await tab.page.waitForFunction(() => window.simd.settled());
    return tab.page.evaluate(() => [...window.simd.camera.position(), ...window.simd.camera.target()]);
  };
  const tab = await Tab.open(context, daemon.url);
  // The user has moved the camera: it is no longer fitted automatically.
  const move = () => window.simd.camera.look([9, 9, 9], [8, 8, 8]);
  await tab.page.evaluate(move);
  await tab.page.keyboard.press("f");
  const expected = await fitted(tab);

  const slow = await context.newPage();
  let release = (): void => undefined;
  const held = new Promise<void>((resolve) => (release = resolve));
  await slow.route("**/meshes/*", async (route) => {
    await held;
    await route.continue();
  });
  await slow.goto(daemon.url);
  await slow.waitForFunction(() => (window.simd?.stats.pictures() ?? 0) > 0);
  await slow.evaluate(move);
  await slow.keyboard.press("f");
  release();
  await slow.waitForFunction(() => window.simd.settled());
  const seen = await slow.evaluate(() => [...window.simd.camera.position(), ...window.simd.camera.target()]);
  seen.forEach((value, index) => expect(value).toBeCloseTo(expected[index] ?? Number.NaN, 3));
});

test("an A1 stands, and its contacts are shown", async () => {
  daemon = await use.daemon(Daemon.start(["--asset-root", pybulletData()]));
  await ground();
  const joints: Record<string, number> = {};
  for (const leg of ["FR", "FL", "RR", "RL"]) {
    joints[`${leg}_upper_joint`] = 0.8;
    joints[`${leg}_lower_joint`] = -1.6;
  }
  const robot = await load(resolve(pybulletData(), "a1/a1.urdf"), { base: Base.FREE, z: 0.32, joints });
  const tab = await Tab.open(context, daemon.url);
  await tab.page.getByTestId("toggle-contacts").click();
  await tab.page.waitForFunction(() => (window.simd.frame()?.contacts.length ?? 0) >= 4);
  const { pose } = await daemon.entities.getEntityState({ robot });
  expect(pose?.position?.z).toBeGreaterThan(0.2);
  await tab.picture("a1");
});

test("a robot of thirty joints can be used: filtered, and moved by its slider", async () => {
  daemon = await use.daemon(Daemon.start(["--asset-root", resolve(REPOSITORY, "tests/assets")]));
  const robot = await load(resolve(REPOSITORY, "tests/assets/humanoid/urdf/humanoid.urdf"), { base: Base.FIXED, z: 1.2 });
  const tab = await Tab.open(context, daemon.url);
  const { layout } = await daemon.joints.getJointLayout({ robot });
  const moving = layout?.joints.filter((joint) => joint.velocityCount > 0) ?? [];
  expect(moving.length).toBeGreaterThanOrEqual(30);
  await expect.poll(() => tab.page.getByTestId("slider").count()).toBe(moving.length);
  const name = moving.at(-1)?.name ?? "";
  await tab.page.keyboard.press("/");
  await tab.page.keyboard.type(name);
  await expect.poll(() => tab.page.getByTestId("slider").count()).toBe(1);
  const slider = tab.page.getByTestId("slider").first();
  await slider.focus();
  const before = (await daemon.joint(robot, name)).target;
  await slider.press("Shift+ArrowRight");
  await expect.poll(async () => (await daemon.joint(robot, name)).target).not.toBe(before);
  await tab.page.getByTestId("filter").fill("");
  await tab.picture("humanoid");
});

/** The page that replaces the viewer in a binary without it, compared with the daemon's numbers. */
async function fallback(): Promise<{ url: string; close: () => void }> {
  const folder = resolve(REPOSITORY, "server/src/http/fallback");
  const types: Record<string, string> = { "/": "text/html", "/style.css": "text/css", "/page.js": "text/javascript" };
  const server = createServer((request, response) => {
    void (async () => {
      const path = request.url ?? "/";
      const type = types[path];
      if (type !== undefined) {
        response.setHeader("content-type", type);
        response.end(await readFile(resolve(folder, path === "/" ? "index.html" : path.slice(1))));
        return;
      }
      const answer = await fetch(new URL(path, daemon.url));
      response.statusCode = answer.status;
      response.end(Buffer.from(await answer.arrayBuffer()));
    })();
  });
  await new Promise<void>((done) => server.listen(0, "127.0.0.1", done));
  const address = server.address();
  const port = typeof address === "object" && address !== null ? address.port : 0;
  return { url: `http://127.0.0.1:${port}/`, close: () => server.close() };
}

test("the page that stands in for the viewer shows the joints and says how to get the rest", async () => {
  daemon = await use.daemon(Daemon.demo());
  const tables = await fallback();
  // Applies even if the context serves the page from a folder.
  await context.unrouteAll();
  try {
    const page = await context.newPage();
    await page.goto(tables.url);
    await page.getByRole("cell", { name: "shoulder" }).waitFor();
    expect(await page.locator(".notice").first().textContent()).toContain("make build");
    await daemon.aim("bench_arm", { shoulder: 0.5 });
    await page.getByRole("cell", { name: "0.5000 rad" }).first().waitFor();
    await page.screenshot({ path: resolve(REPOSITORY, "target/screenshots/tables.png") });
  } finally {
    tables.close();
  }
});
