// Card beside the picture with the robot or part that is being placed, and its pose in numbers.
import type { JSX } from "preact";
import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import { Throttle } from "../daemon/throttle";
import { Icon } from "../panels/icons";
import type { Pose } from "../state/scene";
import { placing, placingMode, type Placing } from "../state/tools";
import { making } from "../state/undo";
import { frame, robots, type Robot } from "../state/world";
import { NumberField } from "./Fields";
import { coordinatesOf, setCoordinates, type Coordinates } from "./placement";

export function PlaceCard(): JSX.Element | null {
  const wanted = placing.value;
  const robot = robots.value.find(({ name }) => name === wanted?.robot);
  // It may have gone.
  useEffect(() => {
    if (wanted && !robot) placing.value = null;
  }, [wanted, robot]);
  if (!wanted || !robot) return null;
  const isJoint = wanted.joint !== undefined;
  return (
    <section
      class="card place-card"
      aria-label={`Place ${robot.name}`}
      data-testid="place-card"
      onKeyDown={(event) => {
        // A field has the keys of the page to itself.
        if (event.key === "Escape") placing.value = null;
      }}
    >
      <header>
        <h2>{robot.name}</h2>
        <button type="button" class="button quiet sign" aria-label="Close" title="Close (Escape)" data-testid="place-close" onClick={() => (placing.value = null)}>
          <Icon name="close" />
        </button>
      </header>
      <label class="build-field">
        <span>What is moved</span>
        <Parts robot={robot} wanted={wanted} />
      </label>
      {!isJoint && (
        <div class="segments" role="group" aria-label="What the handles do">
          {(["translate", "rotate"] as const).map((mode) => (
            <button key={mode} type="button" aria-pressed={placingMode.value === mode} data-testid={`place-${mode}`} onClick={() => (placingMode.value = mode)}>
              {mode === "translate" ? "Move" : "Turn"}
            </button>
          ))}
        </div>
      )}
      {isJoint ? <p class="hint">Drag the handle in the picture; the rows of the panel take numbers.</p> : <Numbers key={`${robot.name} ${wanted.link ?? ""}`} robot={robot} link={wanted.link} />}
    </section>
  );
}

/** The robot, a link that its joints move, or a joint. */
function Parts({ robot, wanted }: { robot: Robot; wanted: Placing }): JSX.Element {
  const driven = robot.axes.filter(({ actuated, axis, isBall }) => actuated && axis === 0 && !isBall);
  const links = [...new Set(driven.map(({ childLink }) => childLink))];
  const value = wanted.joint !== undefined ? `joint ${wanted.joint}` : wanted.link !== undefined ? `link ${wanted.link}` : "robot";
  return (
    <select
      data-testid="place-part"
      value={value}
      onChange={(event) => {
        const [, kind, name] = /^(\w+) ?([^]*)$/.exec(event.currentTarget.value) ?? [];
        placing.value = { robot: robot.name, ...(kind === "link" && name !== undefined && { link: name }), ...(kind === "joint" && name !== undefined && { joint: name }) };
      }}
    >
      <option value="robot">the robot itself</option>
      {links.length > 0 && (
        <optgroup label="a link, by its joints">
          {links.map((name) => (
            <option key={name} value={`link ${name}`}>
              {name}
            </option>
          ))}
        </optgroup>
      )}
      {driven.length > 0 && (
        <optgroup label="a joint">
          {driven.map(({ joint }) => (
            <option key={joint} value={`joint ${joint}`}>
              {joint}
            </option>
          ))}
        </optgroup>
      )}
    </select>
  );
}

/** Minimum milliseconds between two calls, while an arrow key is held. */
const INTERVAL = 50;
const AXES = ["x", "y", "z"] as const;
const ANGLES = ["roll", "pitch", "yaw"] as const;
const NONE: Coordinates = new Map();

/** Its pose in numbers that can be set; for a link only the position. */
function Numbers({ robot, link }: { robot: Robot; link: string | undefined }): JSX.Element | null {
  const pose = poseIn(robot, link);
  const [asked, setAsked] = useState(NONE);
  // One call after the other, so that the newest is the last.
  const calls = useMemo(() => new Throttle(INTERVAL), []);
  const pending = useRef<{ to: Coordinates; since?: bigint } | null>(null);
  // Requested numbers are shown until a state contains them, so that the next arrow key starts from there.
  const state = frame.value?.sequence ?? 0n;
  const showState = (): void => {
    pending.current = null;
    setAsked(NONE);
  };
  useEffect(() => {
    const { since } = pending.current ?? {};
    if (since !== undefined && state >= since) showState();
  }, [state]);
  if (!pose) return null;
  const now = coordinatesOf(pose).map((value, index) => asked.get(index) ?? value);
  const set = (index: number, value: number): void => {
    const to = new Map(pending.current?.to).set(index, value);
    setAsked(to);
    pending.current = { to };
    const call = async (): Promise<void> => {
      const since = await setCoordinates(robot, link, to);
      if (pending.current?.to !== to) return;
      if (since === undefined || (frame.peek()?.sequence ?? 0n) >= since) showState();
      else pending.current = { to, since };
    };
    void making(calls.next(call));
  };
  return (
    <>
      <div class="build-row">
        {AXES.map((axis, index) => (
          <NumberField
            key={axis}
            label={axis}
            testId={`place-${axis}`}
            whenEntered
            value={now[index] ?? 0}
            onChange={(value) => set(index, value)}
          />
        ))}
      </div>
      {link === undefined && (
        <div class="build-row">
          {ANGLES.map((name, index) => (
            <NumberField
              key={name}
              label={name}
              testId={`place-${name}`}
              kind="angle"
              whenEntered
              value={now[3 + index] ?? 0}
              onChange={(value) => set(3 + index, value)}
            />
          ))}
        </div>
      )}
    </>
  );
}

function poseIn(robot: Robot, link: string | undefined): Pose | undefined {
  const index = link === undefined ? 0 : robot.links.indexOf(link);
  const seven = frame.value?.poses.get(robot.name)?.subarray(7 * index, 7 * index + 7);
  return seven?.length === 7 ? ([...seven] as unknown as Pose) : undefined;
}
