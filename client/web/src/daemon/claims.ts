// Claims of this page on robots and on the world: taken, renewed, sent along with the calls that they allow, and released.
import { Code, ConnectError } from "@connectrpc/connect";
import { effect, signal } from "@preact/signals";
import { connection, robots } from "../state/world";
import { toast } from "../state/toasts";
import { attempt } from "./attempt";
import { daemonConnection } from "./page";
import { services, tabName } from "./services";
import { heldClaims, keepClaims, WORLD } from "./held-claims";

/** Wall seconds after which the claim of a closed page ends. A hidden tab renews once a minute. */
const LEASE = 150;
const RENEWAL = 20_000;

/** Names of robots that this page has claimed; `WORLD` is the world. */
export const claimedHere = signal<ReadonlySet<string>>(new Set(heldClaims().keys()));

/** Claims a robot, or the world. */
export async function claim(what: string): Promise<void> {
  await attempt(async () => {
    const selections = what === WORLD ? [] : [{ robot: what }];
    const { claim: secret } = await services().joints.claimJoints({ selections, world: what === WORLD, holder: tabName(), lease: LEASE });
    keep(what, secret);
  });
  daemonConnection().pollAllNow();
}

/** Releases a claim. */
export async function release(what: string): Promise<void> {
  const secret = heldClaims().get(what);
  if (secret === undefined) return;
  await attempt(() => services().joints.releaseJoints({ claim: secret }));
  keep(what, undefined);
  daemonConnection().pollAllNow();
}

/** Releases all claims. */
export async function releaseAll(): Promise<void> {
  for (const what of [...heldClaims().keys()]) await release(what);
}

/** Renews all claims, with targets for no joint. Messages report claims that have ended; they are no longer sent. */
export async function renew(): Promise<void> {
  for (const [what, secret] of [...heldClaims()]) {
    const robot = what === WORLD ? robots.peek()[0]?.name : what;
    try {
      await services().joints.setJointTargets({ claim: secret, robots: robot === undefined ? [] : [{ robot }] });
    } catch (error) {
      // The claim has ended, or its robot is gone.
      if (!(error instanceof ConnectError) || error.code !== Code.NotFound) continue;
      keep(what, undefined);
      toast("info", `${what === WORLD ? "The world" : what} is no longer claimed by this page: another client took it over, or this page was away for too long.`);
    }
  }
}

function keep(what: string, secret: string | undefined): void {
  keepClaims(what, secret);
  claimedHere.value = new Set(heldClaims().keys());
}

/** Renews claims from now on, as long as the page has any. */
export function keepRenewing(): () => void {
  return effect(() => {
    if (claimedHere.value.size === 0 || connection.value.state !== "live") return undefined;
    // A claim from before a reload of the page may have ended.
    void renew();
    const timer = setInterval(() => void renew(), RENEWAL);
    return () => clearInterval(timer);
  });
}
