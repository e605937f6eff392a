// The bar below the view while a recording is shown: its time line, playback controls, and events.
import { signal, useSignalEffect, type Signal } from "@preact/signals";
import { fromBinary } from "@bufbuild/protobuf";
import type { JSX } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { wordsOf, type Words } from "../daemon/event-words";
import { EventSchema } from "../gen/simd/v1/event_pb";
import { Icon } from "../panels/icons";
import { Popover } from "../panels/Popover";
import { ghostsAlone } from "../state/playback";
import { plotsOpen } from "../state/view";
import { close } from ".";
import { SPEEDS, type Player } from "./player";

/** An event of the recording, in words. */
interface Marker extends Words {
  /** State after which it happened. */
  at: number;
}

/** Maximum number of marks on the time line. */
const MAX_MARKS = 200;

/** The bar. */
export function PlaybackBar({ player }: { player: Player }): JSX.Element {
  const markers = useMarkers(player);
  const playing = player.playing.value;
  return (
    <section class="playback" aria-label={`Recording ${player.name}`} data-testid="playback">
      <div class="playback-line">
        <div class="transport" role="group" aria-label="Play the recording">
          <button type="button" class="button sign" data-testid="playback-back" aria-label="One state back" title="One state back (Left)" onClick={() => player.step(-1)}>
            <Icon name="back" />
          </button>
          <button type="button" class="button sign primary" data-testid="playback-play" aria-label={playing ? "Pause the recording" : "Play the recording"} title={`${playing ? "Pause" : "Play"} (Space)`} onClick={() => player.toggle()}>
            <Icon name={playing ? "pause" : "play"} />
          </button>
          <button type="button" class="button sign" data-testid="playback-forward" aria-label="One state forward" title="One state forward (Right)" onClick={() => player.step(1)}>
            <Icon name="step" />
          </button>
        </div>
        <TimeLine player={player} markers={markers.value} />
        <Time player={player} />
        <SpeedChoice player={player} />
      </div>
      <div class="playback-line">
        <span class="playback-name" title={player.name}>
          <Icon name="film" /> {player.name}
        </span>
        <span class="hint" role="status" data-testid="playback-note" title={player.problems.value.join(" ")}>
          {player.waiting.value ? "reading …" : (player.problems.value[0] ?? "")}
        </span>
        <Events player={player} markers={markers.value} />
        <button type="button" class="button quiet" data-testid="playback-alone" aria-pressed={ghostsAlone.value} title="Hide the robots of the world while the recording is shown" onClick={() => (ghostsAlone.value = !ghostsAlone.value)}>
          Alone
        </button>
        <button type="button" class="button quiet" data-testid="playback-plots" aria-pressed={plotsOpen.value} title="Plots of the recording (P)" onClick={() => (plotsOpen.value = !plotsOpen.value)}>
          <Icon name="plots" /> Plots
        </button>
        <button type="button" class="button quiet sign" data-testid="playback-close" aria-label="Close the recording" title="Close the recording (Escape)" onClick={close}>
          <Icon name="close" />
        </button>
      </div>
    </section>
  );
}

/** The slider, with a mark for each event. */
function TimeLine({ player, markers }: { player: Player; markers: readonly Marker[] }): JSX.Element {
  const range = useRef<HTMLInputElement>(null);
  useSignalEffect(() => {
    const input = range.current;
    if (!input) return;
    input.value = String(Math.floor(player.position.value));
    input.setAttribute("aria-valuetext", timeText(player, player.position.value));
    input.style.setProperty("--share", String(player.end > 0 ? player.position.value / player.end : 0));
  });
  return (
    <div class="time-line">
      <input
        ref={range}
        type="range"
        min={0}
        max={player.end}
        step={1}
        aria-label="Time in the recording"
        data-testid="time-line"
        onInput={(event) => {
          player.playing.value = false;
          player.seek(event.currentTarget.valueAsNumber);
        }}
      />
      <div class="marks" aria-hidden="true" data-testid="marks">
        {markers.slice(0, MAX_MARKS).map(({ at, text, isWarning }, index) => (
          <span key={index} class={isWarning ? "mark warning" : "mark"} style={{ left: `${(100 * at) / Math.max(1, player.end)}%` }} title={text} />
        ))}
      </div>
    </div>
  );
}

/** Position in the recording, and the simulated time there. */
function Time({ player }: { player: Player }): JSX.Element {
  const position = useRef<HTMLSpanElement>(null);
  const simulated = useRef<HTMLSpanElement>(null);
  useSignalEffect(() => {
    if (position.current) position.current.textContent = timeText(player, player.position.value);
    const time = player.shown.value?.simTime ?? NaN;
    if (simulated.current) simulated.current.textContent = Number.isNaN(time) ? "" : `t ${time.toFixed(3)} s`;
  });
  return (
    <span class="playback-time">
      <span ref={position} data-testid="playback-time" title="In the recording" /> <span ref={simulated} class="hint" data-testid="playback-sim-time" title="Simulated time then" />
    </span>
  );
}

/** "12.34 s of 60.00 s". */
function timeText({ timeline, end }: Player, position: number): string {
  return `${(Math.floor(position) * timeline.period).toFixed(2)} s of ${(end * timeline.period).toFixed(2)} s`;
}

function SpeedChoice({ player }: { player: Player }): JSX.Element {
  return (
    <select data-testid="playback-speed" aria-label="Speed of the recording, times real time" title="Speed of the recording, times real time" value={String(player.speed.value)} onChange={(event) => (player.speed.value = Number(event.currentTarget.value))}>
      {SPEEDS.map((speed) => (
        <option key={speed} value={String(speed)}>
          {speed}x
        </option>
      ))}
    </select>
  );
}

/** List of events; each seeks to its time. */
function Events({ player, markers }: { player: Player; markers: readonly Marker[] }): JSX.Element | null {
  if (markers.length === 0) return null;
  return (
    <Popover class="button quiet" testId="playback-events" title="What happened in the recording" face={`${markers.length} event${markers.length === 1 ? "" : "s"}`}>
      {(shut) => (
        <ul class="happenings" data-testid="playback-event-list">
          {markers.map(({ at, text, isWarning }, index) => (
            <li key={index} class={isWarning ? "warning" : ""}>
              <button
                type="button"
                class="link"
                onClick={() => {
                  player.playing.value = false;
                  player.seek(at);
                  shut();
                }}
              >
                <span class="tabular">{(at * player.timeline.period).toFixed(2)} s</span> {text}
              </button>
            </li>
          ))}
        </ul>
      )}
    </Popover>
  );
}

/** Reads the events of a recording, once. */
function useMarkers(player: Player): Signal<readonly Marker[]> {
  const markers = useRef(signal<readonly Marker[]>([])).current;
  useEffect(() => {
    let isWanted = true;
    markers.value = [];
    void player.timeline.events().then((events) => {
      if (isWanted) markers.value = events.map(({ at, data }) => ({ at, ...inWords(data) }));
    });
    return () => {
      isWanted = false;
    };
  }, [player]);
  return markers;
}

function inWords(data: Uint8Array): Words {
  try {
    return wordsOf(fromBinary(EventSchema, data));
  } catch {
    return { text: "An event that cannot be read", isWarning: true };
  }
}
