// The progress of the robot that is being loaded.
import type { JSX } from "preact";
import { loading } from "../state/report";

/** A card over the view, rendered only while a robot is being loaded. */
export function LoadProgress(): JSX.Element | null {
  const now = loading.value;
  if (!now) return null;
  const { what, phase, done, total, item } = now;
  return (
    <section class="card loading" role="status" data-testid="loading">
      <p>
        <b>{what}</b>
        <span class="phase">{phase}</span>
      </p>
      {total > 0 ? <progress max={total} value={done} aria-label={`${what}: ${phase}`} /> : <progress aria-label={`${what}: ${phase}`} />}
      <p class="item">{item || "\u00a0"}</p>
    </section>
  );
}
