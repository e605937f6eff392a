// Commands of simctl for the daemon that serves this page.

/** The default endpoint of simctl. */
const DEFAULT = "127.0.0.1:7400";

/** The command that loads a robot. */
export function loadCommand(host: string): string {
  return simctl("robot load path/to/robot.urdf", host);
}

/** A command with the address of the daemon, where simctl would look elsewhere. */
export function simctl(words: string, host: string): string {
  // The default port of http is not that of simctl.
  const address = /:\d+$/.test(host) ? host : `${host}:80`;
  const there = host === DEFAULT || host === "localhost:7400" ? "" : ` --endpoint ${address}`;
  return `simctl ${words}${there}`;
}
