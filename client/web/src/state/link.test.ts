// A link to the page restores the view in which it was copied.
import { beforeEach, expect, test, vi } from "vitest";

const storage = { getItem: () => null, setItem: () => undefined };
vi.stubGlobal("localStorage", storage);
vi.stubGlobal("sessionStorage", storage);
const { shownCamera } = await import("./camera");
const { followLink, linkTo } = await import("./link");
const view = await import("./view");

const ADDRESS = "http://127.0.0.1:7400/";

beforeEach(() => {
  for (const { value, initial } of view.kept.values()) value.value = initial;
  shownCamera.value = { position: [1.23456789, -2, 3], target: [0, 0.5, 0], fieldOfView: 0.6, width: 800, height: 600, followed: 0n };
});

test("camera, robot, layers and plots are as they were, and what is a user's own stays", () => {
  view.contacts.value = true;
  view.grid.value = false;
  view.plotsOpen.value = true;
  view.plottedSlots.value = [["arm 1/elbow & co", 3]];
  view.theme.value = "dark";
  const link = linkTo(ADDRESS, "arm 1");
  expect(link.startsWith(`${ADDRESS}#`)).toBe(true);
  for (const { value, initial } of view.kept.values()) value.value = initial;
  view.collisions.value = true;
  view.theme.value = "light";
  expect(followLink(new URL(link).hash)).toBe(true);
  expect(view.cameraView.value).toEqual([
    [1.2346, -2, 3],
    [0, 0.5, 0],
  ]);
  expect([view.contacts.value, view.grid.value, view.collisions.value, view.plotsOpen.value]).toEqual([true, false, false, true]);
  expect([view.selectedRobot.value, view.plottedSlots.value, view.theme.value]).toEqual(["arm 1", [["arm 1/elbow & co", 3]], "light"]);
});

test("invalid parts of a link change nothing", () => {
  expect(followLink("")).toBe(false);
  expect(followLink("#elsewhere")).toBe(false);
  expect(followLink("#view={broken")).toBe(true);
  followLink(`#${new URLSearchParams({ view: JSON.stringify({ camera: [[1, 2], "x"], contacts: "yes", grid: false, __proto__: 1 }) })}`);
  expect([view.cameraView.value, view.contacts.value, view.grid.value]).toEqual([null, false, false]);
  expect(followLink(`#view=${"9".repeat(30_000)}`)).toBe(false);
});
