// Dropped or chosen files are loaded: folders, zips and files, one or several robots. Files that are too large get a message.

import { mkdir, mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { dirname, resolve } from "node:path";

import { afterEach, beforeEach, expect, test } from "vitest";

import { zipOf } from "../src/load/zip-fixture";
import { inSight, Tab } from "./browser";
import { Daemon, REPOSITORY } from "./daemon";
import { fixtures } from "./fixtures";

const use = fixtures();
const PART = resolve(REPOSITORY, "tests/assets/Bench_Arm-1.2 rev B/meshes/arm.STL");
let daemon: Daemon;
let tab: Tab;
let folder: string;

beforeEach(async () => {
  folder = await mkdtemp(`${tmpdir()}/simd-drop-`);
  daemon = await use.daemon(Daemon.start(["--gravity", "0,0,0"]));
  tab = await Tab.open(await use.context(), daemon.url);
});
afterEach(() => rm(folder, { recursive: true }));

const names = async (): Promise<string[]> => (await daemon.entities.listEntities({})).entities.map(({ name }) => name);
const toasts = async (): Promise<string> => (await tab.page.getByTestId("toast").allTextContents()).join("\n");

/** Returns a robot of `links` boxes on one another, each this wide along y. */
function urdf(name: string, links: number, wide = 0.1): string {
  const box = `<geometry><box size="0.1 ${wide} 0.1"/></geometry>`;
  const all = Array.from({ length: links }, (_, index) => `<link name="l${index}"><visual>${box}</visual><collision>${box}</collision></link>`);
  const joints = all.slice(1).map((_, index) => `<joint name="j${index}" type="continuous"><parent link="l${index}"/><child link="l${index + 1}"/><origin xyz="0 0 0.2"/></joint>`);
  return `<robot name="${name}">${all.join("")}${joints.join("")}</robot>`;
}

/** Returns a robot of a link with a mesh of another file. */
const meshed = (name: string, mesh: string): string => `<robot name="${name}"><link name="a"><visual><geometry><mesh filename="${mesh}"/></geometry></visual></link></robot>`;

async function write(path: string, content: string | Uint8Array): Promise<string> {
  const full = resolve(folder, path);
  await mkdir(dirname(full), { recursive: true });
  await writeFile(full, content);
  return full;
}

/** Drags files of this machine into the page, and drops them in the middle of the picture. */
async function drop(...files: string[]): Promise<void> {
  const session = await tab.page.context().newCDPSession(tab.page);
  const data = { items: [], files, dragOperationsMask: 1 };
  await session.send("Input.dispatchDragEvent", { type: "dragEnter", x: 500, y: 350, data });
  await tab.page.getByTestId("drop-overlay").waitFor();
  const hint = await tab.page.getByTestId("drop-overlay").textContent();
  for (const word of ["folder", "zip", "URDF", "xacro", "SDF", "MJCF", "MCAP"]) expect(hint).toContain(word);
  await session.send("Input.dispatchDragEvent", { type: "dragOver", x: 500, y: 350, data });
  await tab.picture("drop-hint");
  await session.send("Input.dispatchDragEvent", { type: "drop", x: 500, y: 350, data });
  await session.detach();
}

test("a zip that is dropped is opened, and its meshes are found", async () => {
  const zip = await write(
    "my_arm-main.zip",
    zipOf([
      { name: "package.xml", bytes: "<package><name>my_arm</name></package>" },
      { name: "urdf/arm.urdf", bytes: meshed("arm", "package://my_arm/meshes/part.STL") },
      { name: "meshes/part.STL", bytes: await readFile(PART) },
    ]),
  );
  await drop(zip);
  await tab.page.getByTestId("load-now").click();
  await expect.poll(names).toEqual(["arm"]);
  await expect.poll(() => tab.requests.filter(({ pathname }) => pathname.startsWith("/meshes/")).length).toBe(1);
  await tab.page.waitForFunction(() => window.simd.settled());
  await tab.picture("zip-loaded");
  expect(tab.consoleMessages).toEqual([]);
});

test("files without a description, a zip that is none, and one that would fill the memory, are refused in words", async () => {
  const input = tab.page.getByTestId("file-input").first();
  await input.setInputFiles(await write("readme.txt", "a robot"));
  expect(await inSight(tab.page, "load-problem")).toContain("The dropped files have no URDF");
  await tab.page.keyboard.press("Escape");
  await tab.page.getByTestId("load-sheet").waitFor({ state: "detached" });
  await input.setInputFiles(await write("arm.zip", "<robot/>"));
  await expect.poll(toasts).toContain("arm.zip is not a zip file");
  await input.setInputFiles(await write("bomb.zip", zipOf([{ name: "d/a.urdf", bytes: Buffer.alloc(2 << 20, " ") }])));
  await expect.poll(toasts).toContain("d/a.urdf in bomb.zip is more than 250 times as long as it is packed");
  expect(await names()).toEqual([]);
});

test("a file is chosen next to a folder", async () => {
  expect(await tab.page.getByTestId("empty-world").textContent()).toContain("Choose a file");
  const [chooser] = await Promise.all([tab.page.waitForEvent("filechooser"), tab.page.getByTestId("open-file").first().click()]);
  await chooser.setFiles(await write("one.urdf", urdf("one", 2)));
  expect(await tab.page.getByTestId("load-found").textContent()).toBe("one.urdf");
  await tab.page.getByTestId("load-now").click();
  await expect.poll(names).toEqual(["one"]);
});

test("the chosen ones of many descriptions are loaded, side by side", async () => {
  for (let index = 0; index < 12; index += 1) await write(`robots/urdf/robot_${index}.urdf`, urdf(`robot_${index}`, index + 1, 3));
  await write("robots/launch/show.xml", "<launch/>");
  await write("robots/scene.xml", "<mujoco><worldbody><body/></worldbody></mujoco>");
  await drop(resolve(folder, "robots"));
  const choices = tab.page.getByTestId("load-choice");
  await expect.poll(() => choices.count()).toBe(13);
  expect(await choices.first().textContent()).toBe("robot_0.urdfURDF1 link");
  expect(await choices.last().textContent()).toBe("scene.xmlMJCF1 link");
  expect(await tab.violations()).toEqual([]);
  await tab.page.getByTestId("load-filter").fill("robot_1");
  await expect.poll(() => choices.count()).toBe(3);
  for (const name of ["robot_10.urdf", "robot_11.urdf"]) await choices.filter({ hasText: name }).getByRole("checkbox").check();
  expect(await tab.page.getByTestId("load-now").textContent()).toContain("Load 3 robots");
  await tab.picture("load-choices");
  await tab.page.getByTestId("load-now").click();
  await expect.poll(async () => (await names()).sort()).toEqual(["robot_0", "robot_10", "robot_11"]);
  // The progress ends with the last one.
  await tab.page.getByTestId("loading").waitFor({ state: "detached" });
  const { links } = await daemon.contacts.getLinkBounds({});
  const reach = (robot: string) => {
    const own = links.filter((each) => each.robot === robot);
    return { lower: Math.min(...own.map(({ lower }) => lower?.y ?? NaN)), upper: Math.max(...own.map(({ upper }) => upper?.y ?? NaN)) };
  };
  expect(reach("robot_10").lower).toBeGreaterThan(reach("robot_0").upper);
  expect(reach("robot_11").lower).toBeGreaterThan(reach("robot_10").upper);
  // Each is spawned once, at its final place.
  expect(tab.requests.filter(({ pathname }) => pathname.endsWith("DeleteEntity"))).toEqual([]);
  await tab.shows(daemon);
  await tab.picture("side-by-side");
  // A reset puts them at their present positions.
  const placeOf = async (robot: string) => (await daemon.entities.getEntityState({ robot })).pose?.position;
  const before = await placeOf("robot_11");
  expect(before?.y).toBeCloseTo(reach("robot_11").lower + 1.5, 6);
  // On the ground, and not in it.
  expect(before?.z).toBeCloseTo(0.05, 6);
  await daemon.simulation.resetSimulation({ time: true, state: true });
  expect(await placeOf("robot_11")).toEqual(before);
});

test("a robot without collision shapes stands on the ground by what is drawn, from its first state on", async () => {
  const look = '<visual><origin xyz="0 0 -0.2"/><geometry><box size="0.4 0.4 0.6"/></geometry></visual>';
  await drop(await write("post.urdf", `<robot name="post"><link name="base">${look}</link></robot>`));
  await tab.page.getByTestId("load-now").click();
  await expect.poll(names).toEqual(["post"]);
  expect((await daemon.entities.getEntityState({ robot: "post" })).pose?.position?.z).toBeCloseTo(0.5, 12);
  await tab.shows(daemon);
  await tab.picture("drawn-on-the-ground");
  // The spawn puts it there: the page moves no robot afterwards.
  expect(tab.requests.filter(({ pathname }) => pathname.endsWith("SetEntityState"))).toEqual([]);
});

test("a description of 50 MB and a mesh beyond the limit are refused before they are sent", async () => {
  const calls = (): number => tab.requests.filter(({ pathname }) => /PrepareDescription|UploadAsset|ExpandXacro/.test(pathname)).length;
  const { limits } = await daemon.simulation.getSimulatorInfo({});
  const big = `<robot name="big"><link name="a"/>${" ".repeat(50e6)}</robot>`;
  await drop(await write("big.urdf", big));
  await tab.page.getByTestId("load-now").click();
  await expect.poll(toasts).toContain(`big.urdf: the size of the description in bytes would be ${big.length}, and the limit is ${limits?.maxDescriptionBytes}.`);
  expect(calls()).toBe(0);
  await tab.picture("too-large");
  await write("far/a.urdf", meshed("far", "b.stl"));
  const length = Number(limits?.maxAssetBytes) + 1;
  await write("far/b.stl", Buffer.alloc(length));
  await drop(resolve(folder, "far"));
  await tab.page.getByTestId("load-now").click();
  await expect.poll(toasts).toContain(`b.stl: the size of the file in bytes would be ${length}, and the limit is ${limits?.maxAssetBytes}.`);
  // The page requested the names of the description's files, and sent none.
  expect(tab.requests.filter(({ pathname }) => pathname.endsWith("UploadAsset"))).toEqual([]);
  expect(await names()).toEqual([]);
});

test("a large drop says at once that the page looks for files", async () => {
  // The browser lists a folder slowly: it waits until the test lets it continue.
  await tab.page.evaluate(() => {
    const page = window as unknown as { release: () => void };
    const held = new Promise<void>((done) => (page.release = done));
    const entryOf = DataTransferItem.prototype.webkitGetAsEntry;
    DataTransferItem.prototype.webkitGetAsEntry = function () {
      const entry = entryOf.call(this) as FileSystemDirectoryEntry;
      const reader = entry.createReader();
      entry.createReader = () => ({ readEntries: (done, failed) => void held.then(() => reader.readEntries(done, failed)) });
      return entry;
    };
  });
  await write("many/arm.urdf", urdf("arm", 1));
  for (let index = 0; index < 300; index += 1) await write(`many/meshes/${index}.stl`, "");
  await drop(resolve(folder, "many"));
  await expect.poll(() => tab.page.getByTestId("loading").textContent()).toContain("looking for files");
  await tab.picture("looking-for-files");
  await tab.page.evaluate(() => (window as unknown as { release: () => void }).release());
  await expect.poll(() => tab.page.getByTestId("load-sheet").textContent()).toContain("300 other files");
  await tab.page.getByTestId("loading").waitFor({ state: "detached" });
});

test("two presses on the demo arm add one", async () => {
  await tab.page.getByTestId("add-demo-arm").dblclick();
  await expect.poll(() => tab.page.getByTestId("slider").count()).toBe(5);
  expect(await names()).toEqual(["demo_arm"]);
});
