// Commands and programs that reach the daemon of this page, as they are typed.
import { role } from "../state/world";

/** How a daemon is reached. */
export interface Reached {
  /** Its name or address, with the port where that is not the scheme's own. */
  host: string;
  isTls: boolean;
  /** It asks for tokens. */
  asksToken: boolean;
  /** What it is called over Zenoh. */
  name: string;
}

/** The default endpoint of simctl. */
const DEFAULTS: readonly string[] = ["127.0.0.1:7400", "localhost:7400"];
/** The port of Zenoh, unless the operator chose another. */
const ZENOH_PORT = 7447;

/** How the daemon of this page is reached. */
export function here(name: string): Reached {
  return { host: location.host, isTls: location.protocol === "https:", asksToken: role.value !== null, name };
}

/** The command that loads a robot. */
export function loadCommand(to: Reached): string {
  return simctl("robot load path/to/robot.urdf", to);
}

/** A command with the options that simctl needs to reach the daemon. */
export function simctl(words: string, { host, isTls, asksToken }: Reached): string {
  // The default ports of http and https are not that of simctl.
  const address = /:\d+$/.test(host) ? host : `${host}:${isTls ? 443 : 80}`;
  const endpoint = isTls ? ` --endpoint https://${address} --tls-ca ca.pem` : DEFAULTS.includes(host) ? "" : ` --endpoint ${address}`;
  return `simctl ${words}${endpoint}${asksToken ? " --token-file token.txt" : ""}`;
}

/** A program in Python that moves a joint. */
export function pythonProgram({ host, isTls, asksToken, name }: Reached): string {
  const machine = host.replace(/:\d+$/, "");
  const isDefault = !isTls && !asksToken && ["127.0.0.1", "localhost", "[::1]"].includes(machine);
  const locator = `"${isTls ? "tls" : "tcp"}/${machine}:${ZENOH_PORT}#${name}"`;
  const given = [locator, ...(isTls ? ['config=simd_client.tls.authority("ca.pem")'] : []), ...(asksToken ? ['token="simd_..."'] : [])];
  return `import simd_client

with simd_client.connect(${isDefault ? "" : given.join(", ")}) as sim:
    arm = sim.load("path/to/robot.urdf", fixed=True)
    arm.joints["elbow"].target = 0.5  # rad`;
}
