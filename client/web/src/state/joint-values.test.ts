// Ball joints as rows of roll, pitch and yaw.
import { describe, expect, test } from "vitest";
import { axisValues, ballNow, quaternionOf, rollPitchYaw, type Quaternion, type Triple } from "./joint-values";
import type { Axis, JointValues, Mode } from "./world";

/** A robot of a hinge and a ball joint. */
function axis(part: number): Axis {
  return {
    key: `arm/ball${part > 0 ? `/${part}` : ""}`, robot: "arm", joint: "ball", axis: part, label: "ball", kind: "angle", isBall: true,
    positionIndex: 1, velocityIndex: 1 + part, childLink: "bob", actuated: true, claimedBy: "",
  };
}

function values(orientation: Quaternion, target: Triple, mode: Mode): JointValues {
  return {
    position: [9, ...orientation],
    velocity: [9, 1, 2, 3],
    effort: [9, 4, 5, 6],
    target: [9, ...target],
    mode: ["hold", mode, mode, mode],
    flags: [0, 1, 0, 0],
  };
}

const read = (of: JointValues): (number | undefined)[] => [0, 1, 2].map((part) => axisValues(axis(part), of)?.position);

describe("angles", () => {
  test("are about the fixed axes x, y and z in this order, as in URDF", () => {
    const half = Math.SQRT1_2;
    // A quarter turn about x, and then one about z: the child's z points along x.
    expect(rollPitchYaw([0.5, 0.5, 0.5, 0.5]).map((angle) => angle * 2)).toEqual([expect.closeTo(Math.PI), expect.closeTo(0), expect.closeTo(Math.PI)]);
    expect(rollPitchYaw([0, half, 0, half])[1]).toBeCloseTo(Math.PI / 2, 7);
  });

  test("make the same orientation again, also at a pitch of a quarter turn", () => {
    for (const angles of [[0.3, -0.7, 2.5], [-3, 1.2, -0.1], [0, Math.PI / 2, 0.4], [0.5, -Math.PI / 2, 1], [0, 0, 0]] as Triple[]) {
      const quaternion = quaternionOf(angles);
      const again = quaternionOf(rollPitchYaw(quaternion));
      const same = quaternion.reduce((sum, part, index) => sum + part * (again[index] ?? 0), 0);
      expect(Math.abs(same)).toBeCloseTo(1, 12);
    }
  });

  test("are zero for values that are not an orientation", () => {
    expect(rollPitchYaw([0, 0, 0, 0])).toEqual([0, 0, 0]);
    expect(rollPitchYaw([NaN, 0, 0, 1])).toEqual([0, 0, 0]);
  });
});

describe("rows", () => {
  const angles: Triple = [0.3, -0.7, 2.5];

  test("show an orientation of any sign and length as roll, pitch and yaw", () => {
    const quaternion = quaternionOf(angles).map((part) => -2 * part) as Quaternion;
    const shown = read(values(quaternion, [0, 0, 0], "passive"));
    shown.forEach((angle, part) => expect(angle).toBeCloseTo(angles[part] ?? NaN, 12));
  });

  test("show a target that the daemon has as a rotation vector in the same angles", () => {
    const shown = [0, 1, 2].map((part) => axisValues(axis(part), values([0, 0, 0, 1], [0, 0, 1.5], "position")));
    expect(shown.map((row) => row?.target)).toEqual([0, 0, expect.closeTo(1.5, 12)]);
    expect(shown.map((row) => row?.velocity)).toEqual([1, 2, 3]);
    expect(shown.map((row) => row?.flags)).toEqual([1, 0, 0]);
  });

  test("show velocities and torques about the child's axes unchanged", () => {
    const row = axisValues(axis(1), values([0, 0, 0, 1], [0.1, 0.2, 0.3], "velocity"));
    expect(row).toMatchObject({ target: 0.2, velocity: 2, effort: 5, mode: "velocity" });
  });

  test("are none if the arrays are too short", () => {
    expect(axisValues(axis(0), { position: [0, 0, 0, 0], velocity: [], effort: [], target: [], mode: ["none", "hold"], flags: [] })).toBeUndefined();
  });
});

describe("the other two of a target", () => {
  test("are the targets in the same mode, and else what the joint does", () => {
    const now = values(quaternionOf([0.3, -0.7, 2.5]), [0, 0, 1.5], "position");
    expect(ballNow(axis(1), "position", now)).toEqual([0, 0, expect.closeTo(1.5, 12)]);
    expect(ballNow(axis(1), "velocity", now)).toEqual([1, 2, 3]);
    expect(ballNow(axis(2), "effort", now)).toEqual([4, 5, 6]);
    const free = { ...now, mode: ["hold", "passive", "passive", "passive"] as Mode[] };
    ballNow(axis(0), "position", free).forEach((angle, part) => expect(angle).toBeCloseTo([0.3, -0.7, 2.5][part] ?? NaN, 12));
  });
});
