// Asks for a token if the daemon requires one. The browser keeps it in a cookie that this page cannot read.
import { signal } from "@preact/signals";
import type { JSX } from "preact";
import { useRef } from "preact/hooks";
import { messageOf } from "../daemon/error-message";
import { retryNow } from "../daemon/page";
import { Icon } from "./icons";

/** Reason why the last token was refused. */
const refusal = signal("");

/** A card in the middle of the view. */
export function LogIn(): JSX.Element {
  const field = useRef<HTMLInputElement>(null);
  const logIn = async (event: Event): Promise<void> => {
    event.preventDefault();
    const token = field.current?.value.trim() ?? "";
    try {
      const answer = await fetch("login", { method: "POST", headers: { authorization: `Bearer ${token}` } });
      refusal.value = answer.ok ? "" : (await answer.text()).trim();
      if (answer.ok) retryNow();
    } catch (error) {
      refusal.value = messageOf(error);
    }
  };
  return (
    <form class="card log-in" data-testid="log-in" onSubmit={(event) => void logIn(event)}>
      <h2>
        <Icon name="lock" /> This daemon asks for a token
      </h2>
      <p>
        <code>simctl token add NAME --role viewer</code> makes one on the daemon’s machine. This browser keeps it until it is closed.
      </p>
      <input ref={field} type="password" aria-label="Token" placeholder="simd_…" autocomplete="current-password" required data-testid="token" />
      {refusal.value && (
        <p class="refusal" role="alert" data-testid="refusal">
          {refusal.value}
        </p>
      )}
      <button type="submit" class="button primary">
        Log in
      </button>
    </form>
  );
}
