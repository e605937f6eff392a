// Commands and programs that reach the daemon of this page, as the user types them.
import { role } from "../state/world";

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

/** A program in Python that moves a joint. */
export function pythonProgram({ host, isTls, asksToken }: Reached): string {
  const page = `"${isTls ? "https" : "http"}://${withPort(host, isTls)}"`;
  const given = [page, ...(isTls ? ['config=simd_client.tls.authority("ca.pem")'] : []), ...(asksToken ? ['token="simd_..."'] : [])];
  return `import simd_client

with simd_client.connect(${given.join(", ")}) as sim:
    arm = sim.load("path/to/robot.urdf", fixed=True)
    arm.joints["elbow"].target = 0.5  # rad`;
}
