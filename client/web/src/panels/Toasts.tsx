// Short messages in a corner; screen readers read them when they appear.
import type { JSX } from "preact";
import { dismiss, toasts } from "../state/toasts";
import { Icon } from "./icons";

/** Always rendered, so that new messages are read out. */
export function Toasts(): JSX.Element {
  return (
    <div class="toasts" role="log" aria-live="polite" aria-label="Messages">
      {toasts.value.map(({ id, kind, sentence, count }) => (
        <div key={id} class={`toast ${kind}`} data-testid="toast" role={kind === "error" ? "alert" : undefined}>
          <Icon name={kind === "error" ? "warning" : "info"} />
          <p>
            {sentence}
            {count > 1 && <span class="count"> ×{count}</span>}
          </p>
          <button type="button" class="button quiet" aria-label="Dismiss" title="Dismiss" onClick={() => dismiss(id)}>
            <Icon name="close" />
          </button>
        </div>
      ))}
    </div>
  );
}
