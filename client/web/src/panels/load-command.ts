// The simctl line that loads a robot into this daemon.

/** What simctl takes where nobody says otherwise. */
const DEFAULT = "127.0.0.1:7400";

/** The line that loads a robot into the daemon that serves this page. */
export function loadCommand(host: string): string {
  // An address without a port is on the one of http, and simctl would take its own.
  const address = /:\d+$/.test(host) ? host : `${host}:80`;
  const there = host === DEFAULT || host === "localhost:7400" ? "" : ` --endpoint ${address}`;
  return `simctl robot load path/to/robot.urdf${there}`;
}
