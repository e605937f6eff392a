// The simctl command that loads a robot into this daemon.

/** The default endpoint of simctl. */
const DEFAULT = "127.0.0.1:7400";

/** The command that loads a robot into the daemon that serves this page. */
export function loadCommand(host: string): string {
  // The default port of http is not that of simctl.
  const address = /:\d+$/.test(host) ? host : `${host}:80`;
  const there = host === DEFAULT || host === "localhost:7400" ? "" : ` --endpoint ${address}`;
  return `simctl robot load path/to/robot.urdf${there}`;
}
