// The button that claims a robot or the world for this page, and releases it.
import type { JSX } from "preact";
import { claim, claimedHere, release } from "../daemon/claims";
import { WORLD } from "../daemon/held-claims";
import { connection } from "../state/world";
import { Icon } from "./icons";

interface Properties {
  /** The robot's name, or `WORLD`. */
  what: string;
  /** The client that has claimed it; empty without one. */
  holder: string;
  /** Reason why it cannot be claimed; empty if it can. */
  whyNot: string;
}

export function ClaimButton({ what, holder, whyNot }: Properties): JSX.Element {
  const isOwn = claimedHere.value.has(what);
  const name = what === WORLD ? "the world" : what;
  const meaning = what === WORLD ? "only you play, pause, step and reset it" : "only you move and change it";
  return (
    <button
      type="button"
      class="button quiet sign"
      data-testid={what === WORLD ? "claim-world" : "claim-robot"}
      aria-label={`Claim ${name}`}
      aria-pressed={isOwn}
      title={isOwn ? `You have claimed ${name}: ${meaning}. Press to release it` : whyNot || `Claim ${name}: ${meaning}, until you release it or leave`}
      disabled={(!isOwn && (whyNot !== "" || holder !== "")) || connection.value.state !== "live"}
      onClick={() => void (isOwn ? release(what) : claim(what))}
    >
      <Icon name={isOwn ? "lock" : "unlocked"} />
    </button>
  );
}
