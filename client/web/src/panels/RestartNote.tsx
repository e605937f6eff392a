// Note that the daemon was restarted, with an offer to load this page's last robots again.
import type { JSX } from "preact";
import { loadAgain } from "../daemon/again";
import { whyNotAll } from "../state/permission";
import { restarted } from "../state/restart";
import { Icon } from "./icons";

/** Rendered only while it has robots to offer. */
export function RestartNote(): JSX.Element | null {
  if (!restarted.value) return null;
  const { at, robots } = restarted.value;
  const time = at.toLocaleTimeString([], { hour: "2-digit", minute: "2-digit", hourCycle: "h23" });
  return (
    <div class="restart-note" role="status" data-testid="restart-note">
      <span>The daemon restarted at {time}. Load the last robots again?</span>
      <button type="button" class="button" data-testid="load-again" disabled={whyNotAll.value !== ""} title={whyNotAll.value || robots.join(", ")} onClick={() => void loadAgain()}>
        Load {robots.length === 1 ? robots[0] : `${robots.length} robots`}
      </button>
      <button type="button" class="button quiet" data-testid="load-not-again" aria-label="Dismiss" title="Dismiss" onClick={() => (restarted.value = null)}>
        <Icon name="close" />
      </button>
    </div>
  );
}
