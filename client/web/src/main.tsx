// Where the page begins: mounts it, and starts to ask the daemon.
import { render } from "preact";
import { startLink } from "./daemon/page";
import { App } from "./panels/App";

const root = document.getElementById("app");
if (root) {
  // First: the daemon answers while the page is put together.
  startLink();
  render(<App />, root);
}
