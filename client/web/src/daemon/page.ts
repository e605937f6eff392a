// The one connection of this page, which polls while the page is visible.
import { DaemonConnection } from "./daemon-connection";
import { services } from "./services";

let connection: DaemonConnection | undefined;

/** The connection of this page. */
export function daemonConnection(): DaemonConnection {
  connection ??= new DaemonConnection(services());
  return connection;
}

/** Polls the daemon from now on, while the page is not hidden. */
export function startPolling(): void {
  const update = () => daemonConnection().setVisible(!document.hidden);
  document.addEventListener("visibilitychange", update);
  window.addEventListener("online", () => daemonConnection().retry());
  update();
}

/** Reconnects to a lost daemon now, without waiting for the countdown. */
export function retryNow(): void {
  daemonConnection().retry();
}
