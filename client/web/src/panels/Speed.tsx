// The target real-time factor and the one reached.
import type { JSX } from "preact";
import { useState } from "preact/hooks";
import { setSpeed } from "../daemon/actions";
import { whyNotWorld } from "../state/permission";
import { toast } from "../state/toasts";
import { connection, physics, simulation } from "../state/world";
import { Icon } from "./icons";
import { shownFactor, readFactor } from "./factor";

const OFFERED: readonly number[] = [0.1, 0.2, 0.5, 1, 2, 5, 10];
const OTHER = "other";

/** The menu of real-time factors, and the factor reached. */
export function Speed(): JSX.Element {
  return (
    <div class="speed">
      <SpeedChoice />
      <Factor />
    </div>
  );
}

function SpeedChoice(): JSX.Element {
  const [typing, setTyping] = useState(false);
  const settings = physics.value;
  const target = settings?.asFastAsPossible ? Infinity : (settings?.realTimeFactor ?? simulation.value.target);
  if (typing) {
    const take = (box: HTMLInputElement): void => {
      const factor = readFactor(box.value);
      if (typeof factor === "string") toast("error", factor);
      else void setSpeed(factor);
      setTyping(false);
    };
    return (
      <input
        ref={(box) => box?.focus()}
        class="number"
        type="text"
        inputMode="decimal"
        aria-label="Speed, times real time"
        placeholder="0.25"
        data-testid="speed-number"
        onBlur={() => setTyping(false)}
        onKeyDown={(event) => {
          if (event.key === "Enter") take(event.currentTarget);
          if (event.key === "Escape") setTyping(false);
        }}
      />
    );
  }
  const choices = OFFERED.includes(target) || target === Infinity ? OFFERED : [...OFFERED, target].sort((a, b) => a - b);
  return (
    <select
      data-testid="speed"
      aria-label="Speed, times real time"
      title={whyNotWorld.value || "Speed, times real time; max is as fast as possible"}
      disabled={whyNotWorld.value !== ""}
      value={String(target)}
      onChange={(event) => {
        const { value } = event.currentTarget;
        if (value === OTHER) {
          setTyping(true);
        } else {
          void setSpeed(Number(value));
        }
      }}
    >
      {choices.map((factor) => (
        <option key={factor} value={String(factor)}>
          {factor}x
        </option>
      ))}
      <option value="Infinity">max</option>
      <option value={OTHER}>other …</option>
    </select>
  );
}

/** "0.62x of 1.00x", in the warning colour if the simulation cannot keep up. */
function Factor(): JSX.Element {
  const { state, actual, target, behind, overruns, stepDuration } = simulation.value;
  const away = connection.value.state !== "live";
  if (away || state !== "playing") {
    return (
      <span class="factor idle" data-testid="factor" title={away ? "The daemon does not answer" : "Simulated time does not advance"}>
        {away ? "–" : state}
      </span>
    );
  }
  const step = physics.value?.timeStep ?? 0;
  const why =
    `It reaches ${shownFactor(actual)} of ${shownFactor(target)}` +
    (behind && step > 0 && stepDuration > 0 ? `: a step of ${(step * 1e3).toPrecision(3)} ms takes ${(stepDuration * 1e3).toPrecision(3)} ms to compute` : "") +
    (overruns > 0n ? `; it fell behind ${overruns} times since the daemon started` : "");
  return (
    <span class={behind ? "factor behind" : "factor"} data-testid="factor" title={why}>
      {behind && <Icon name="warning" />}
      <span class="tabular">
        {shownFactor(actual)} of {shownFactor(target)}
      </span>
      {behind && <span class="cannot">cannot keep up</span>}
    </span>
  );
}
