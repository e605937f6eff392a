// Commands contain exactly the options that reach the page's daemon.
import { expect, test } from "vitest";
import { type Axis, type Robot } from "../state/world";
import { exampleOf, loadCommand, pythonProgram, type Reached } from "./commands";

const near: Reached = { host: "127.0.0.1:7400", isTls: false, asksToken: false };

test("the line names the daemon only if simctl would not find it", () => {
  expect(loadCommand(near)).toBe("simctl robot load path/to/robot.urdf");
  expect(loadCommand({ ...near, host: "lab:7410" })).toBe("simctl robot load path/to/robot.urdf --endpoint lab:7410");
  expect(loadCommand({ ...near, host: "lab" })).toContain("--endpoint lab:80");
});

test("TLS and tokens take the authority and a file with the token", () => {
  const far = { ...near, host: "127.0.0.1:7400", isTls: true, asksToken: true };
  expect(loadCommand(far)).toBe("simctl robot load path/to/robot.urdf --endpoint https://127.0.0.1:7400 --tls-ca ca.pem --token-file token.txt");
  expect(loadCommand({ ...far, host: "lab.example" })).toContain("https://lab.example:443");
});

test("a program connects to the daemon of the page and to no other", () => {
  expect(pythonProgram(near)).toContain('connect("http://127.0.0.1:7400")');
  expect(pythonProgram({ ...near, host: "[2001:db8::1]:7410" })).toContain('connect("http://[2001:db8::1]:7410")');
  expect(pythonProgram({ ...near, host: "lab" })).toContain('connect("http://lab:80")');
  expect(pythonProgram({ host: "lab:7400", isTls: true, asksToken: true })).toContain(
    'connect("https://lab:7400", config=simd_client.tls.authority("ca.pem"), token="simd_...")',
  );
});

test("a program moves a joint of the shown robot to a reachable position", () => {
  const axis = (joint: string, more: Partial<Axis>): Partial<Axis> => ({ joint, axis: 0, actuated: true, kind: "angle", ...more });
  const robot = (...axes: Partial<Axis>[]): Robot => ({ name: 'arm "1"', axes }) as unknown as Robot;
  expect(pythonProgram(near, exampleOf(robot(axis("follower", { actuated: false }), axis("elbow", { upper: 0.25 }))))).toContain(
    'arm = sim.robot("arm \\"1\\"")\n    arm.joints["elbow"].target = 0.25  # rad',
  );
  expect(exampleOf(robot(axis("slide", { kind: "length", lower: -1, upper: 1 })))).toMatchObject({ joint: "slide", target: 0.05, unit: "m" });
  expect(exampleOf(robot(axis("ball", { isBall: true })))).toBeUndefined();
  expect(pythonProgram(near)).toContain('sim.load("path/to/robot.urdf", fixed=True)');
});
