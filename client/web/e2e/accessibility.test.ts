// Accessibility of the whole page: axe in light and dark, on a phone and in each sheet. All sheets open by keys.

import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { resolve } from "node:path";

import { afterEach, expect, test } from "vitest";

import { ConstraintKind } from "../src/gen/simd/v1/constraint_pb";
import { Base } from "../src/gen/simd/v1/entity_pb";
import { SimulationState } from "../src/gen/simd/v1/simulation_pb";
import { Tab } from "./browser";
import { Daemon, REPOSITORY } from "./daemon";
import { fixtures } from "./fixtures";

const use = fixtures();

let folder = "";
afterEach(async () => {
  await rm(folder, { recursive: true, force: true });
});

/** Two robots with sensors, a constraint, a parameter, a recording, a saved state, and a report with a warning. */
async function furnished(): Promise<Daemon> {
  folder = await mkdtemp(`${tmpdir()}/simd-axe-`);
  const daemon = await use.daemon(Daemon.demo("--gravity", "0,0,0", "--recordings", folder, "--asset-root", resolve(REPOSITORY, "tests/assets")));
  const path = resolve(REPOSITORY, "tests/assets/humanoid/urdf/humanoid.urdf");
  await daemon.entities.spawnEntity({ name: "humanoid", source: { source: { case: "path", value: path } }, base: Base.FIXED, pose: { position: { x: 0, y: 2, z: 1.2 } } });
  const box = { geometry: { case: "box", value: { size: { x: 0.2, y: 0.2, z: 0.2 } } }, mass: 1 } as const;
  for (const [name, y] of [["crate_1", -1], ["crate_2", -1.4]] as const) {
    await daemon.entities.spawnEntity({ name, base: Base.FREE, pose: { position: { x: 0, y, z: 1 } }, source: { source: { case: "primitive", value: box } } });
  }
  await daemon.constraints.createConstraint({ name: "weld", kind: ConstraintKind.WELD, parent: { robot: "crate_1" }, child: { robot: "crate_2" } });
  await daemon.sensors.createSensor({ sensor: { robot: "bench_arm", name: "imu", kind: { case: "imu", value: {} } } });
  await daemon.parameters.addParameter({ parameter: { name: "speed", kind: { case: "slider", value: { minimum: 0, maximum: 1, value: 0.5 } } } });
  await daemon.simulation.saveState({ name: "start" });
  await daemon.recordings.startRecording({ name: "run" });
  await daemon.pass(0.2);
  await daemon.recordings.stopRecording({});
  return daemon;
}

/** Sheets, opened only by keys: a shortcut, or buttons one after the other, each by Enter; and the element by which each is known. */
const SHEETS: readonly { name: string; keys?: string; buttons?: readonly string[]; shows: string }[] = [
  { name: "keys", keys: "?", shows: "help-sheet" },
  { name: "how to begin", buttons: ["help", "help-begin"], shows: "guide" },
  { name: "picture", keys: "s", shows: "picture-sheet" },
  { name: "camera", buttons: ["view-menu"], shows: "orthographic" },
  { name: "recordings", buttons: ["recordings"], shows: "recordings-sheet" },
  { name: "clients", buttons: ["clients"], shows: "client-list" },
  { name: "text size", buttons: ["text-size"], shows: "text-size-200" },
  { name: "building", buttons: ["build"], shows: "build-menu" },
  { name: "a shape", buttons: ["build", "build-add"], shows: "add-sheet" },
  { name: "all robots", buttons: ["build", "build-robots"], shows: "robots-sheet" },
  { name: "saved states", buttons: ["build", "build-states"], shows: "states-sheet" },
  { name: "a question", keys: "Backspace", shows: "ask-sheet" },
  { name: "moving", buttons: ["build", "build-place"], shows: "place-card" },
];

/** Presses a button by its key, once it is visible: a sheet that opens takes the focus. */
async function enter(tab: Tab, id: string): Promise<void> {
  const button = tab.page.getByTestId(id).first();
  await button.waitFor();
  await button.focus();
  await tab.page.keyboard.press("Enter");
}

/** All differences from light to dark: the elements are the same. */
const COLOURS = ["color-contrast", "link-in-text-block"];

/**
 * Returns the problems that axe finds in the present theme and in the colours of the other one; the theme stays. Also returns whether the page
 * is wider than its window.
 */
async function problems(tab: Tab, what: string): Promise<string[]> {
  const found = await tab.violations();
  const other = (await tab.page.locator("html").getAttribute("data-theme")) === "dark" ? "light" : "dark";
  await tab.page.emulateMedia({ colorScheme: other });
  await tab.page.waitForFunction((theme) => document.documentElement.dataset["theme"] === theme, other);
  found.push(...(await tab.violations(COLOURS)).map((violation) => `in ${other}: ${violation}`));
  const overflow = await tab.page.evaluate(() => document.documentElement.scrollWidth - window.innerWidth);
  if (overflow > 0) found.push(`the page is ${overflow} pixels wider than the window`);
  return found.map((problem) => `${what}: ${problem}`);
}

/** Opens a sheet by keys, waits until it is shown, and returns its problems. */
async function found(tab: Tab, { name, keys, buttons = [], shows }: (typeof SHEETS)[number]): Promise<string[]> {
  if (keys !== undefined) await tab.page.keyboard.press(keys);
  for (const button of buttons) {
    await enter(tab, button);
  }
  const shown = tab.page.getByTestId(shows);
  await shown.waitFor();
  const violations = await problems(tab, name);
  await tab.page.keyboard.press("Escape");
  await shown.waitFor({ state: "detached" });
  return violations;
}

const PHONE = { width: 390, height: 844 };
const VIEWS = [
  { name: "a window", options: { colorScheme: "light" } },
  { name: "a phone", options: { colorScheme: "light", viewport: PHONE, hasTouch: true } },
] as const;

for (const { name, options } of VIEWS) {
  test(`axe finds nothing in ${name}, light and dark: the page, its panels, and each sheet, opened by keys`, async () => {
    const daemon = await furnished();
    const tab = await Tab.open(await use.context(options), daemon.url);
    const violations: string[] = [];
    const look = async (what: string): Promise<void> => {
      violations.push(...(await problems(tab, what)));
    };
    // Without another client, no question is asked.
    await tab.seesAnother(daemon);
    if (!(await tab.page.getByTestId("panel").isVisible())) await tab.page.keyboard.press("b");
    await tab.page.keyboard.press("1");
    await tab.page.getByTestId("sensor-imu").waitFor();
    await look("the page");
    await tab.page.keyboard.press("2");
    await expect.poll(() => tab.page.getByTestId("slider").count()).toBeGreaterThan(20);
    await look("thirty joints");
    await tab.page.keyboard.press("i");
    await tab.page.getByTestId("structure").waitFor();
    await tab.page.locator(".tree summary").first().focus();
    await tab.page.keyboard.press("Enter");
    await look("the structure");
    await tab.page.keyboard.press("i");
    // Everything that is drawn over the picture.
    for (const key of ["c", "j", "n", "a", "m", "e", "k", "w"]) await tab.page.keyboard.press(key);
    await tab.page.getByTestId("side-front").waitFor();
    await look("marks");
    for (const key of ["c", "j", "n", "a", "m", "e", "k", "w"]) await tab.page.keyboard.press(key);
    await tab.page.keyboard.press("p");
    await tab.page.getByTestId("series-picker").waitFor();
    await look("plots");
    await tab.page.keyboard.press("p");
    for (const sheet of SHEETS) violations.push(...(await found(tab, sheet)));
    // A recording is played, and closed by its key.
    await enter(tab, "recordings");
    await enter(tab, "play-recording");
    await tab.page.getByTestId("playback").waitFor();
    await look("a recording");
    await tab.page.keyboard.press("Escape");
    await tab.page.getByTestId("playback").waitFor({ state: "detached" });
    expect(violations).toEqual([]);
    await tab.picture(`axe-${name.replaceAll(" ", "-")}`);
    // A lost daemon, last.
    await daemon.kill();
    await tab.page.getByTestId("banner").waitFor();
    expect(await problems(tab, "a lost daemon")).toEqual([]);
  });
}

test("a robot is brought in, moved, plotted, placed, saved and removed without a pointer", async () => {
  const daemon = await use.daemon(Daemon.start(["--gravity", "0,0,0"]));
  const tab = await Tab.open(await use.context({ acceptDownloads: true }), daemon.url);
  const names = async () => (await daemon.entities.listEntities({})).entities.map(({ name }) => name);
  await enter(tab, "add-demo-arm");
  await expect.poll(names).toEqual(["demo_arm"]);
  await expect.poll(() => tab.page.getByTestId("slider").count()).toBe(5);
  // From the first field on, Tab leads to each slider; arrows move it.
  await tab.page.keyboard.press("/");
  await tab.page.keyboard.type("elbow");
  await expect.poll(() => tab.page.getByTestId("slider").count()).toBe(1);
  await tab.page.getByTestId("slider").waitFor();
  const focused = () => tab.page.evaluate(() => (document.activeElement as HTMLElement | null)?.dataset["testid"] ?? "");
  for (let presses = 0; presses < 20 && (await focused()) !== "slider"; presses += 1) await tab.page.keyboard.press("Tab");
  expect(await focused()).toBe("slider");
  await tab.page.keyboard.press("Shift+ArrowRight");
  await expect.poll(async () => (await daemon.joint("demo_arm", "elbow")).target).toBeGreaterThan(0);
  await enter(tab, "plot-joint");
  await tab.page.getByTestId("plot").first().waitFor();
  // A shape, by its form.
  await enter(tab, "build");
  await enter(tab, "build-add");
  await tab.page.getByTestId("build-name").waitFor();
  await tab.page.getByTestId("build-name").focus();
  await tab.page.keyboard.type("crate");
  await tab.page.keyboard.press("Enter");
  await expect.poll(names).toEqual(["demo_arm", "crate"]);
  await tab.page.getByTestId("add-sheet").waitFor({ state: "detached" });
  // The arm may touch the crate: it stays where it is from here on.
  await daemon.simulation.setSimulationState({ state: SimulationState.PAUSED });
  await daemon.entities.setEntityState({ robot: "crate", twist: {} });
  // The key belongs to the second robot that the page knows.
  await tab.page.getByTestId("robot-crate").waitFor();
  await tab.page.keyboard.press("2");
  await enter(tab, "build");
  await enter(tab, "build-place");
  await tab.page.getByTestId("place-x").waitFor();
  // The number is the page's, which may show a state from before the pause.
  await tab.shows(daemon);
  await tab.page.getByTestId("place-x").focus();
  const before = (await daemon.entities.getEntityState({ robot: "crate" })).pose?.position?.x ?? NaN;
  await tab.page.keyboard.press("Shift+ArrowUp");
  await expect.poll(async () => ((await daemon.entities.getEntityState({ robot: "crate" })).pose?.position?.x ?? NaN) - before).toBeCloseTo(0.1, 6);
  await tab.page.keyboard.press("Escape");
  await tab.page.getByTestId("place-card").waitFor({ state: "detached" });
  // A picture.
  await tab.page.keyboard.press("s");
  await tab.page.getByTestId("save-picture").waitFor();
  await tab.page.getByTestId("save-picture").focus();
  const [download] = await Promise.all([tab.page.waitForEvent("download"), tab.page.keyboard.press("Enter")]);
  expect(download.suggestedFilename()).toMatch(/\.png$/);
  await tab.page.getByTestId("picture-sheet").waitFor({ state: "detached" });
  await tab.page.keyboard.press("Control+z");
  await tab.page.keyboard.press("Control+z");
  await expect.poll(names).toEqual(["demo_arm"]);
});
