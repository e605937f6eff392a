// Banner while the daemon is lost: the reason, and the time of the next attempt.
import { signal } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect } from "preact/hooks";
import { connection } from "../state/world";
import { Icon } from "./icons";

const now = signal(performance.now());

/** Rendered only while the connection is lost. */
export function Banner(): JSX.Element | null {
  const { state, reason, retryAt, needsToken } = connection.value;
  const lost = state === "lost" && !needsToken;
  useEffect(() => {
    if (!lost) return undefined;
    now.value = performance.now();
    const timer = setInterval(() => {
      now.value = performance.now();
    }, 200);
    return () => clearInterval(timer);
  }, [lost]);
  if (!lost) return null;
  const seconds = Math.max(0, Math.ceil((retryAt - now.value) / 1000));
  return (
    <div class="banner" role="alert" data-testid="banner">
      <Icon name="warning" />
      <p>
        <b>{reason || "The daemon does not answer."}</b> <span aria-hidden="true">{seconds > 0 ? `Trying again in ${seconds} s.` : "Trying again …"}</span>
      </p>
    </div>
  );
}
