// The entry point: starts polling the daemon, and mounts the page.
import { render } from "preact";
import { startPolling } from "./daemon/page";
import { App } from "./panels/App";
import { escapeHiddenCharacters } from "./panels/printable";

const root = document.getElementById("app");
if (root) {
  // First, so that the daemon answers while the page is rendered.
  startPolling();
  escapeHiddenCharacters();
  render(<App />, root);
}
