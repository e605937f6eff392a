// Commands and programs that reach the daemon of this page, as the user types them.
import { role, type Robot } from "../state/world";

/** Address and options to reach a daemon. */
export interface Reached {
  /** Its name or address, with the port unless it is the scheme's default. */
  host: string;
  isTls: boolean;
  /** Whether it asks for tokens. */
  asksToken: boolean;
}

/** The default endpoint of simctl. */
const DEFAULTS: readonly string[] = ["127.0.0.1:7400", "localhost:7400"];

/** Returns address and options of this page's daemon. */
export function here(): Reached {
  return { host: location.host, isTls: location.protocol === "https:", asksToken: role.value !== null };
}

/** The command that loads a robot. */
export function loadCommand(to: Reached): string {
  return simctl("robot load path/to/robot.urdf", to);
}

/** A command with the options that simctl needs to reach the daemon. */
export function simctl(words: string, { host, isTls, asksToken }: Reached): string {
  const address = withPort(host, isTls);
  const endpoint = isTls ? ` --endpoint https://${address} --tls-ca ca.pem` : DEFAULTS.includes(host) ? "" : ` --endpoint ${address}`;
  return `simctl ${words}${endpoint}${asksToken ? " --token-file token.txt" : ""}`;
}

/** The default ports of http and https differ from the clients'. */
function withPort(host: string, isTls: boolean): string {
  return /:\d+$/.test(host) ? host : `${host}:${isTls ? 443 : 80}`;
}

/** A joint, and a target that it can reach. */
export interface Example {
  robot: string;
  joint: string;
  target: number;
  unit: "rad" | "m";
}

/** Targets of examples, if limits allow them: radians and metres. */
const EXAMPLES = { angle: { target: 0.5, unit: "rad" }, length: { target: 0.05, unit: "m" } } as const;

/** Returns a target of a joint of this robot; undefined if it has no joint that takes one. */
export function exampleOf(robot: Robot | undefined): Example | undefined {
  const axis = robot?.axes.find(({ actuated, axis, isBall }) => actuated && axis === 0 && !isBall);
  if (!robot || !axis) return undefined;
  const { target, unit } = EXAMPLES[axis.kind];
  return { robot: robot.name, joint: axis.joint, target: Math.min(axis.upper ?? Infinity, Math.max(axis.lower ?? -Infinity, target)), unit };
}

/** A program in Python that moves a joint of a robot of the world, or without one loads a robot first. */
export function pythonProgram({ host, isTls, asksToken }: Reached, example?: Example): string {
  const page = `"${isTls ? "https" : "http"}://${withPort(host, isTls)}"`;
  const given = [page, ...(isTls ? ['config=simd_client.tls.authority("ca.pem")'] : []), ...(asksToken ? ['token="simd_..."'] : [])];
  const { robot, joint, target, unit } = example ?? { robot: undefined, joint: "elbow", ...EXAMPLES.angle };
  const arm = robot === undefined ? 'sim.load("path/to/robot.urdf", fixed=True)' : `sim.robot(${JSON.stringify(robot)})`;
  return `import simd_client

with simd_client.connect(${given.join(", ")}) as sim:
    arm = ${arm}
    arm.joints[${JSON.stringify(joint)}].target = ${target}  # ${unit}`;
}
