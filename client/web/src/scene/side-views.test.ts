// Views from the sides are on the canvas, and do not cover each other.
import { expect, test } from "vitest";
import { places } from "./side-views";

for (const [width, height] of [[1280, 640], [3840, 2000], [700, 400], [390, 700]] as const) {
  test(`three views have room on ${width} by ${height}`, () => {
    const all = places(width, height);
    expect(all.length).toBe(3);
    all.forEach(({ left, top, width: wide, height: high }, index) => {
      expect(wide / high).toBeCloseTo(4 / 3, 6);
      expect(left).toBeGreaterThanOrEqual(0);
      expect(left + wide).toBeLessThanOrEqual(width);
      expect(top + high).toBeLessThanOrEqual(height);
      for (const other of all.slice(index + 1)) expect(other.left >= left + wide || other.top >= top + high).toBe(true);
    });
    // Most of the picture stays visible.
    expect(all.reduce((sum, { width: wide, height: high }) => sum + wide * high, 0)).toBeLessThan(0.3 * width * height);
  });
}
