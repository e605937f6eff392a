// Connected clients: this page first, with its token's name, the token's role, and the button to log out.
import { signal } from "@preact/signals";
import type { JSX } from "preact";
import { releaseAll } from "../daemon/claims";
import { messageOf } from "../daemon/error-message";
import { toast } from "../state/toasts";
import { clients, role, tokenName, type Role } from "../state/world";

const ALLOWS: Record<Role, string> = {
  viewer: "can look, and change nothing",
  operator: "can move robots and record",
  admin: "can do everything: also load robots, play, pause and reset",
};

export function ClientList(): JSX.Element {
  const all = clients.value.toSorted((a, b) => Number(b.isCaller) - Number(a.isCaller));
  return (
    <>
      {role.value && <Token role={role.value} />}
      <ul class="clients" data-testid="client-list">
        {all.map(({ name, idle, isCaller, transport }) => (
          <li key={`${name} ${transport}`}>
            <b>{name}</b>
            <span>{isCaller ? "you" : idle < 1 ? "now" : `${Math.round(idle)} s ago`}</span>
            <span class="hint">{transport}</span>
          </li>
        ))}
      </ul>
    </>
  );
}

const leaving = signal(false);

/** Name of this page's token. */
function Token({ role: own }: { role: Role }): JSX.Element {
  return (
    <div class="who" data-testid="who-am-i">
      <p>
        You are <b>{tokenName}</b>, {own === "viewer" ? "a" : "an"} <b>{own}</b>.<br />
        <span class="hint">You {ALLOWS[own]}.</span>
      </p>
      <button type="button" class="button" data-testid="log-out" title="This browser forgets the token" disabled={leaving.value} onClick={() => void logOut()}>
        Log out
      </button>
    </div>
  );
}

async function logOut(): Promise<void> {
  leaving.value = true;
  await releaseAll();
  try {
    const answer = await fetch("login", { method: "DELETE" });
    if (!answer.ok) throw new Error((await answer.text()).trim());
    // Data that the token allowed to see is removed.
    location.reload();
  } catch (error) {
    toast("error", messageOf(error));
  } finally {
    leaving.value = false;
  }
}
