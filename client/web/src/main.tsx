// The entry point: starts polling the daemon, and mounts the page.
import { render } from "preact";
import { keepRenewing } from "./daemon/claims";
import { startPolling } from "./daemon/page";
import { tabName } from "./daemon/services";
import { App } from "./panels/App";
import { escapeHiddenCharacters } from "./panels/printable";
import { followLinks } from "./state/link";
import { ownName } from "./state/permission";

const root = document.getElementById("app");
if (root) {
  // First, so that the daemon answers while the page is rendered.
  followLinks();
  ownName.value = tabName();
  startPolling();
  keepRenewing();
  escapeHiddenCharacters();
  render(<App />, root);
}
