// What handles have been moved by, about and along the axis of a joint.
import { expect, test } from "vitest";
import type { Pose } from "../state/scene";
import { slideAlong, turnAbout } from "./placement";

const half = Math.SQRT1_2;
const upright: Pose = [1, 2, 3, 0, 0, 0, 1];
/** z along the world's x. */
const lying: Pose = [0, 0, 0, 0, half, 0, half];

test("a turn is about the z of where it began", () => {
  const about = (angle: number): Pose => [1, 2, 3, 0, 0, Math.sin(angle / 2), Math.cos(angle / 2)];
  for (const angle of [0, 0.3, -1.2, 3]) expect(turnAbout(upright, about(angle))).toBeCloseTo(angle, 12);
  // The quaternion of the other sign is the same turn.
  const [x, y, z, a, b, c, d] = about(0.3);
  expect(turnAbout(upright, [x, y, z, -a, -b, -c, -d])).toBeCloseTo(0.3, 12);
});

test("a slide is along the z of where it began", () => {
  expect(slideAlong(upright, [1.5, 2.5, 3.25, 0, 0, 0, 1])).toBeCloseTo(0.25, 12);
  expect(slideAlong(lying, [0.5, 7, 9, 0, half, 0, half])).toBeCloseTo(0.5, 12);
});
