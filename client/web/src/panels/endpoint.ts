// Small facts for people: the simctl line that reaches this daemon, numbers without needless digits.

/** What simctl takes where nobody says otherwise. */
const DEFAULT = "127.0.0.1:7400";

/** The line that loads a robot into the daemon that serves this page. */
export function loadCommand(host: string): string {
  // An address without a port is on the one of http, and simctl would take its own.
  const address = /:\d+$/.test(host) ? host : `${host}:80`;
  const there = host === DEFAULT || host === "localhost:7400" ? "" : ` --endpoint ${address}`;
  return `simctl robot load path/to/robot.urdf${there}`;
}

/** Three digits that count: 12.3, 0.123, 1230. */
export function shortened(value: number): string {
  return Number.isFinite(value) ? String(Number(value.toPrecision(3))) : "–";
}
