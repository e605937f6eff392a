// The grid has its lines at whole metres, and fades out at its reach.
import { expect, test } from "vitest";
import { gridCorners } from "./grid-lines";

const GREY = [0.5, 0.5, 0.5] as const;

test("lines are at whole metres for any middle, and their ends are invisible", () => {
  const corners = gridCorners(3.3, -2.7, 20, GREY);
  for (let at = 0; at < corners.length; at += 2) {
    const [from, to] = [corners[at], corners[at + 1]];
    if (!from || !to) throw new Error("a line has two corners");
    const across = Math.abs(from[0] - to[0]) < 1e-9 ? from[0] : from[1];
    expect(Math.abs(across - Math.round(across))).toBeLessThan(1e-9);
  }
  const outside = corners.filter(([x, y]) => Math.hypot(x - 3.3, y + 2.7) > 19.99);
  expect(outside.length).toBeGreaterThan(0);
  expect(Math.max(...outside.map(([, , , , , opacity]) => opacity))).toBeLessThan(1e-6);
});

test("there are few lines at any distance, and always some", () => {
  for (const reach of [4, 10, 47, 49, 130, 200]) {
    const corners = gridCorners(0, 0, reach, GREY);
    expect(corners.length).toBeGreaterThan(0);
    expect(corners.length).toBeLessThan(10_000);
  }
});

test("the axes of the world have their colours", () => {
  const colours = new Set(gridCorners(0.2, 0.1, 8, GREY).map(([, , red, green]) => (red > green ? "x" : red < green ? "y" : "")));
  expect([...colours].sort()).toEqual(["", "x", "y"]);
});
