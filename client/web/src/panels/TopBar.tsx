// The top bar: playback, speed, time, clients and the connection.
import { useComputed, useSignalEffect } from "@preact/signals";
import type { JSX } from "preact";
import { useRef } from "preact/hooks";
import { playOrPause, step } from "../daemon/actions";
import { WORLD } from "../daemon/held-claims";
import { panelOpen, plotsOpen, theme, type Theme } from "../state/view";
import { happenings } from "../state/happenings";
import { ownName, whyNotChange, whyNotStep, whyNotWorld } from "../state/permission";
import { clients, connection, daemonName, frame, physics, simulation } from "../state/world";
import { ClaimButton } from "./ClaimButton";
import { ClientList } from "./ClientList";
import { Icon, type IconName } from "./icons";
import { Name } from "./Name";
import { Popover } from "./Popover";
import { Recorder } from "./Recorder";
import { askReset, helpOpen } from "./shortcuts";
import { Speed } from "./Speed";
import { TextSize } from "./TextSize";

/** The bar. */
export function TopBar(): JSX.Element {
  return (
    <header class="top-bar">
      <div class="brand">
        <h1>simd</h1>
        <span class="daemon">
          <Name name={daemonName.value} title={`Name of the daemon: ${daemonName.value}`} />
        </span>
      </div>
      <Transport />
      <Speed />
      <Clock />
      <Recorder />
      <span class="spring" />
      <Clients />
      <ConnectionState />
      <PageButtons />
    </header>
  );
}

/** Play and pause, step, reset. */
function Transport(): JSX.Element {
  const playing = useComputed(() => simulation.value.state === "playing").value;
  const away = useComputed(() => connection.value.state !== "live").value;
  const [whyNot, whyNoStep] = [whyNotWorld.value, whyNotStep.value];
  return (
    <div class="transport" role="group" aria-label="Time">
      <button
        type="button"
        class="button sign primary"
        data-testid="play"
        aria-label={playing ? "Pause" : "Play"}
        title={whyNot || (playing ? "Pause (Space)" : "Play (Space)")}
        disabled={away || whyNot !== ""}
        onClick={playOrPause}
      >
        <Icon name={playing ? "pause" : "play"} />
      </button>
      <button
        type="button"
        class="button sign"
        data-testid="step"
        aria-label="Single step"
        title={(playing && whyNot) || whyNoStep || (playing ? "Pause, and do one step (.)" : "One step (.)")}
        disabled={away || whyNoStep !== "" || (playing && whyNot !== "")}
        onClick={() => void step(1)}
      >
        <Icon name="step" />
      </button>
      <button type="button" class="button sign" data-testid="reset" aria-label="Reset" title={whyNot || "Reset time and robots (Backspace)"} disabled={away || whyNot !== ""} onClick={askReset}>
        <Icon name="reset" />
      </button>
      <WorldClaim />
    </div>
  );
}

/** Holder of the world's claim: only the holder plays, pauses and resets; or the button to take it. */
function WorldClaim(): JSX.Element {
  const holder = useComputed(() => simulation.value.claimedBy).value;
  if (holder === "" || holder === ownName.value) return <ClaimButton what={WORLD} holder={holder} whyNot={whyNotChange.value} />;
  return (
    <span class="source claimed" data-testid="world-claimed" title={`${holder} has claimed the world: others cannot play, pause, step or reset it`}>
      <Icon name="lock" />
      {holder}
    </span>
  );
}

/** Simulated time, and the step rate. */
function Clock(): JSX.Element {
  const time = useRef<HTMLSpanElement>(null);
  useSignalEffect(() => {
    const now = frame.value?.simTime;
    const text = now === undefined ? "–" : now.toFixed(3);
    if (time.current && time.current.textContent !== text) time.current.textContent = text;
  });
  const rate = useComputed(() => {
    const settings = physics.value;
    return settings ? `${Number((1 / settings.timeStep).toPrecision(4))} Hz` : "";
  });
  const detail = useComputed(() => {
    const settings = physics.value;
    if (!settings) return "";
    const busy = simulation.value.stepDuration;
    return `Steps of ${Number((settings.timeStep * 1e3).toPrecision(4))} ms${settings.substeps > 1 ? `, each in ${settings.substeps} parts` : ""}${busy > 0 ? `; one takes ${(busy * 1e3).toPrecision(2)} ms to compute` : ""}`;
  });
  return (
    <div class="clock">
      <span class="time" title="Simulated time">
        <span class="time-sign">t </span>
        <span ref={time} data-testid="sim-time">
          –
        </span>{" "}
        s
      </span>
      <span class="rate" title={detail} data-testid="step-rate">
        {rate}
      </span>
    </div>
  );
}

/** The number of clients, and their list. */
function Clients(): JSX.Element | null {
  const all = clients.value;
  if (all.length === 0) return null;
  return (
    <Popover
      class="button quiet"
      testId="clients"
      title="Who is connected, and what happened"
      face={
        <>
          <Icon name="people" />
          <span>
            {all.length} <span class="clients-word">connected</span>
          </span>
        </>
      }
    >
      {() => (
        <>
          <ClientList />
          <Happenings />
        </>
      )}
    </Popover>
  );
}

/** Recent events, newest first. */
function Happenings(): JSX.Element | null {
  if (happenings.value.length === 0) return null;
  return (
    <>
      <h2 class="popover-heading">What happened</h2>
      <ul class="happenings" tabIndex={0} aria-label="What happened" data-testid="happenings">
        {happenings.value.map(({ sequence, simTime, text, isWarning }) => (
          <li key={String(sequence)} class={isWarning ? "warning" : ""}>
            <span class="tabular hint">{simTime.toFixed(2)} s</span> {text}
          </li>
        ))}
      </ul>
    </>
  );
}

const STATES = { connecting: "connecting", live: "live", lost: "lost" } as const;

/** Whether the daemon answers. */
function ConnectionState(): JSX.Element {
  const { state, reason } = connection.value;
  return (
    <span class={`connection ${state}`} role="status" data-testid="connection" title={reason || (state === "live" ? "The daemon answers" : "")}>
      <span class="dot" aria-hidden="true" />
      <span class="connection-word">{STATES[state]}</span>
    </span>
  );
}

const THEMES: readonly Theme[] = ["system", "light", "dark"];

/** The settings of the page. */
function PageButtons(): JSX.Element {
  const next = THEMES[(THEMES.indexOf(theme.value) + 1) % THEMES.length] ?? "system";
  const name: IconName = theme.value;
  return (
    <div class="page-buttons" role="group" aria-label="Page">
      <button
        type="button"
        class="button quiet sign"
        data-testid="theme"
        aria-label={`Colours: ${theme.value}`}
        title={`Colours: ${theme.value}. Press for ${next}`}
        onClick={() => {
          theme.value = next;
        }}
      >
        <Icon name={name} />
      </button>
      <TextSize />
      <Switch value={plotsOpen} icon="plots" testId="plots-toggle" label="Plots" shortcut="P" />
      <Switch value={panelOpen} icon="panel" testId="panel-toggle" label="Side panel" shortcut="B" />
      <button
        type="button"
        class="button quiet sign"
        data-testid="help"
        aria-label="Help"
        title="Help: how to begin, keys and gestures (?)"
        onClick={() => {
          helpOpen.value = "keys";
        }}
      >
        ?
      </button>
    </div>
  );
}

interface SwitchProperties {
  value: { value: boolean };
  icon: IconName;
  testId: string;
  label: string;
  shortcut: string;
}

/** A toggle button. */
export function Switch({ value, icon, testId, label, shortcut }: SwitchProperties): JSX.Element {
  return (
    <button
      type="button"
      class="button quiet sign"
      data-testid={testId}
      aria-label={label}
      aria-pressed={value.value}
      title={`${label} (${shortcut})`}
      onClick={() => {
        value.value = !value.value;
      }}
    >
      <Icon name={icon} />
    </button>
  );
}
