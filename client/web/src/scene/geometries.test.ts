// Pictures on primitives lie as their materials specify.
import { expect, test } from "vitest";
import { PLANE_RADIUS, Primitives, repeatPicture, triangles, type Primitive } from "./geometries";

/** Returns the picture coordinates of each corner, with its position. */
function places(primitive: Primitive, repeat: { x: number; y: number; perMetre: boolean }): { at: number[]; uv: number[] }[] {
  const made = triangles(primitive);
  repeatPicture(made, primitive, repeat);
  const [position, uv] = [made.getAttribute("position"), made.getAttribute("uv")];
  return Array.from({ length: uv.count }, (_, index) => ({
    at: [position.getX(index), position.getY(index), position.getZ(index)],
    uv: [uv.getX(index), uv.getY(index)],
  }));
}

test("on each metre of a plane a picture is there as often as it should, with its middle in the middle", () => {
  const corners = places({ kind: "plane", normal: [0, 0, 1] }, { x: 0.5, y: 2, perMetre: true });
  expect(corners.length).toBeGreaterThan(8);
  for (const { at: [x = 0, y = 0], uv } of corners) {
    expect(uv[0]).toBeCloseTo(0.5 + 0.5 * x, 3);
    expect(uv[1]).toBeCloseTo(0.5 + 2 * y, 3);
  }
  expect(PLANE_RADIUS).toBeGreaterThan(100);
});

test("each side of a box has it by its own metres, or so many times", () => {
  const box: Primitive = { kind: "box", size: [1, 2, 4] };
  const spans = (repeat: { x: number; y: number; perMetre: boolean }) => {
    const corners = places(box, repeat);
    return [0, 8, 16].map((first) => {
      const side = corners.slice(first, first + 4);
      return [0, 1].map((axis) => Math.max(...side.map(({ uv }) => uv[axis] ?? NaN)) - Math.min(...side.map(({ uv }) => uv[axis] ?? NaN)));
    });
  };
  expect(spans({ x: 1, y: 1, perMetre: true })).toEqual([[4, 2], [1, 4], [1, 2]]);
  expect(spans({ x: 3, y: 2, perMetre: false })).toEqual([[3, 2], [3, 2], [3, 2]]);
});

test("equal primitives share their triangles until the last user releases them", () => {
  const shared = new Primitives();
  const box: Primitive = { kind: "box", size: [1, 2, 4] };
  const [first, second] = [shared.acquire(box), shared.acquire({ ...box })];
  expect(second.made).toBe(first.made);
  expect(shared.acquire(box, { x: 2, y: 1, perMetre: false }).made).not.toBe(first.made);
  let freed = 0;
  first.made.addEventListener("dispose", () => (freed += 1));
  first.release();
  expect(freed).toBe(0);
  second.release();
  expect(freed).toBe(1);
  expect(shared.acquire(box).made).not.toBe(first.made);
});

test("round primitives have fewer sides if their edge is off by less than half a pixel", () => {
  const shared = new Primitives();
  const radius = 0.05;
  const { made, release } = shared.acquire({ kind: "cylinder", radius, length: 1 });
  const corners = (pixels: number) => {
    const position = shared.sufficient(made, pixels).getAttribute("position");
    return Array.from({ length: position.count }, (_, index) => Math.atan2(position.getY(index), position.getX(index)));
  };
  expect(new Set(corners(10_000)).size).toBeGreaterThan(30);
  expect(shared.sufficient(made, 10_000)).toBe(made);
  for (const pixels of [1, 50, 150, 230]) {
    // The widest angle between two corners of the edge.
    const angles = [...new Set(corners(pixels).map((angle) => Math.round(1e6 * angle) / 1e6))].sort((a, b) => a - b);
    const widest = Math.max(...angles.slice(1).map((angle, index) => angle - (angles[index] ?? NaN)));
    expect(radius * pixels * (1 - Math.cos(widest / 2))).toBeLessThan(0.5);
  }
  expect(shared.sufficient(made, 100)).not.toBe(made);
  let freed = 0;
  shared.sufficient(made, 100).addEventListener("dispose", () => (freed += 1));
  release();
  expect(freed).toBe(1);
});
