// A row of the joint panel: the name of a joint, its state, and its controls.
import { useComputed, useSignalEffect } from "@preact/signals";
import { Fragment, type JSX } from "preact";
import { useLayoutEffect, useRef, useState } from "preact/hooks";
import { plotted, colorSlotOf, togglePlot } from "../plots/plotted";
import { ownName, whyNotJoint } from "../state/permission";
import { degrees, hoveredLink } from "../state/view";
import { clients, robots, simulation, targetSources, type Axis, type Mode } from "../state/world";
import { AxisControl } from "./axis-control";
import { foundIn } from "./groups";
import { Icon } from "./icons";
import { Name } from "./Name";
import { follow, show } from "./row-updates";

/** The modes of the menu, with short labels that leave room for the slider. */
const MODES: readonly [Mode, string][] = [
  ["position", "pos"],
  ["velocity", "vel"],
  ["effort", "eff"],
  ["passive", "free"],
  ["hold", "hold"],
];

/** A row; `label` is the rest of its name under a heading, and `filter` the filter's text, if any. */
export function JointRow({ axis, label, filter }: { axis: Axis; label: string; filter: string }): JSX.Element {
  const row = useRef<HTMLDivElement>(null);
  const fill = useRef<HTMLDivElement>(null);
  const tick = useRef<HTMLDivElement>(null);
  const zero = useRef<HTMLDivElement>(null);
  const readout = useRef<HTMLSpanElement>(null);
  const badge = useRef<HTMLSpanElement>(null);
  const slider = useRef<HTMLInputElement>(null);
  const number = useRef<HTMLInputElement>(null);
  const mode = useRef<HTMLSelectElement>(null);
  const control = useRef<AxisControl | null>(null);

  // Runs before the row is painted: until it has a state its slider is hidden, and Tab skips it.
  useLayoutEffect(() => {
    if (!row.current || !fill.current || !tick.current || !zero.current || !readout.current || !badge.current) return undefined;
    const made = new AxisControl(axis, {
      row: row.current,
      fill: fill.current,
      tick: tick.current,
      zero: zero.current,
      readout: readout.current,
      badge: badge.current,
      slider: slider.current,
      number: number.current,
      mode: mode.current,
    });
    control.current = made;
    return follow(made);
  }, [axis]);
  useSignalEffect(() => {
    void degrees.value;
    control.current?.refresh();
  });
  const world = useComputed(() => simulation.value.state);
  const disabled = useComputed(() => robots.value.find(({ name }) => name === axis.robot)?.disabledReason);
  // Updates the row when values change that are not part of a joint state.
  useSignalEffect(() => {
    void [world.value, disabled.value];
    if (control.current) show(control.current);
  });
  useSignalEffect(() => {
    const lit = hoveredLink.value;
    row.current?.toggleAttribute("data-lit", lit?.robot === axis.robot && lit.link === axis.childLink);
  });
  const highlight = (): void => {
    hoveredLink.value = { robot: axis.robot, link: axis.childLink };
  };
  const removeHighlight = (): void => {
    hoveredLink.value = null;
  };

  return (
    <div ref={row} class="joint" data-testid={`joint-row-${axis.key}`} onPointerEnter={highlight} onPointerLeave={removeHighlight}>
      <div class="joint-line">
        <PlotSwitch axis={axis} />
        <JointName axis={axis} label={label} filter={filter} />
        <Source axis={axis} />
        <span ref={badge} class="badge" data-testid="badge" />
        <span ref={readout} class="readout" data-testid="actual" />
      </div>
      <div class="joint-line">
        {axis.actuated ? (
          <select
            ref={mode}
            class="mode"
            data-testid="mode"
            aria-label={`Mode of ${axis.label}`}
            title={whyNotJoint(axis) || "Position, velocity, effort, free or hold. A change starts at the joint’s present value, so nothing jerks"}
            disabled={whyNotJoint(axis) !== ""}
            onChange={(event) => void control.current?.changeMode(event.currentTarget.value as Mode)}
          >
            {MODES.map(([value, word]) => (
              <option key={value} value={value}>
                {word}
              </option>
            ))}
          </select>
        ) : (
          <span class="follows" title={axis.mimics ? `Follows ${axis.mimics}` : "Has no actuator"}>
            {axis.mimics ? `follows ${axis.mimics}` : "no actuator"}
          </span>
        )}
        <div class="slider">
          <div class="rail">
            <div ref={fill} class="fill" data-testid="actual-bar" />
          </div>
          <div class="marks">
            <div ref={zero} class="zero" />
            <div ref={tick} class="tick" />
          </div>
          {axis.actuated && <TargetSlider axis={axis} input={slider} control={control} />}
        </div>
        {axis.actuated && <TargetNumber axis={axis} input={number} control={control} />}
      </div>
    </div>
  );
}

/** The name, shortened in its middle. A name that a filter found is shown in full, with the match marked. */
function JointName({ axis, label, filter }: { axis: Axis; label: string; filter: string }): JSX.Element {
  const [isWhole, setWhole] = useState(false);
  if (filter.trim() !== "") {
    return (
      <span class="joint-name whole" title={axis.label}>
        {foundIn(axis.label, filter).map(({ text, found }, index) => (found ? <mark key={index}>{text}</mark> : <Fragment key={index}>{text}</Fragment>))}
      </span>
    );
  }
  // There is no tooltip on a touch screen.
  return (
    <span class={isWhole ? "joint-name whole" : "joint-name"} onClick={() => setWhole(!isWhole)}>
      {isWhole ? axis.label : <Name name={label} title={axis.label} />}
    </span>
  );
}

interface Part {
  axis: Axis;
  input: { current: HTMLInputElement | null };
  control: { current: AxisControl | null };
}

/** The slider of the target. */
function TargetSlider({ axis, input, control }: Part): JSX.Element {
  const release = (): void => control.current?.endDrag();
  return (
    <input
      ref={input}
      type="range"
      step="any"
      data-testid="slider"
      aria-label={`Target of ${axis.label}`}
      title={whyNotJoint(axis) || "Drag, or arrow keys; shift for ten times as far"}
      disabled={whyNotJoint(axis) !== ""}
      onInput={(event) => control.current?.drag(event.currentTarget.valueAsNumber)}
      onPointerDown={() => control.current?.beginDrag()}
      onPointerUp={release}
      onPointerCancel={release}
      onLostPointerCapture={release}
      onKeyDown={(event) => {
        const direction = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 10, PageDown: -10 }[event.key];
        if (direction === undefined || event.ctrlKey || event.altKey || event.metaKey) return;
        event.preventDefault();
        control.current?.nudge(event.shiftKey ? 10 * direction : direction);
      }}
    />
  );
}

/** The number box of the target. */
function TargetNumber({ axis, input, control }: Part): JSX.Element {
  const take = (box: HTMLInputElement): void => {
    if (box.dataset["typed"] === undefined) return;
    const taken = control.current?.type(box.value) ?? false;
    box.setAttribute("aria-invalid", String(!taken));
    if (taken) forget(box);
  };
  const forget = (box: HTMLInputElement): void => {
    delete box.dataset["typed"];
    box.removeAttribute("aria-invalid");
    control.current?.refresh();
  };
  return (
    <input
      ref={input}
      class="number"
      type="text"
      inputMode="text"
      spellcheck={false}
      autocomplete="off"
      data-testid="number"
      aria-label={`Target of ${axis.label}, with its unit`}
      title={whyNotJoint(axis) || "Type a target, with a unit if you like: 90 deg, 0.2 rad, 5 cm, 2*(0.1 + 0.2). Arrow keys nudge, shift for ten times as far"}
      disabled={whyNotJoint(axis) !== ""}
      onFocus={(event) => event.currentTarget.select()}
      onInput={(event) => {
        event.currentTarget.dataset["typed"] = "";
      }}
      onBlur={(event) => {
        const box = event.currentTarget;
        take(box);
        // Invalid text is replaced by the target.
        if (box.dataset["typed"] !== undefined) forget(box);
      }}
      onKeyDown={(event) => {
        const box = event.currentTarget;
        const direction = { ArrowUp: 1, ArrowDown: -1 }[event.key];
        if (event.key === "Enter") {
          take(box);
          box.select();
        } else if (event.key === "Escape") {
          event.stopPropagation();
          forget(box);
          box.blur();
        } else if (direction !== undefined) {
          event.preventDefault();
          take(box);
          control.current?.nudge(event.shiftKey ? 10 * direction : direction);
        }
      }}
    />
  );
}

/** The client that set the last target of the joint, or the client that has claimed it. */
function Source({ axis }: { axis: Axis }): JSX.Element | null {
  const source = useComputed(() => {
    const name = targetSources.value.get(`${axis.robot}/${axis.joint}`) ?? "";
    const own = name !== "" && clients.value.some((client) => client.isCaller && client.name === name);
    return own ? "you" : name;
  });
  if (axis.claimedBy !== "" && axis.claimedBy !== ownName.value) {
    return (
      <span class="source claimed" data-testid="claimed" title={`${axis.claimedBy} has claimed this joint: others cannot set its target`}>
        <Icon name="lock" />
        {axis.claimedBy}
      </span>
    );
  }
  if (source.value === "") return null;
  return (
    <span class="source" data-testid="source" title={`Its target was last set by ${source.value}`}>
      by {source}
    </span>
  );
}

/** Adds the joint to the plots, or removes it; shows its colour there. */
function PlotSwitch({ axis }: { axis: Axis }): JSX.Element {
  const isPlotted = useComputed(() => plotted.value.has(axis.key));
  const colour = useComputed(() => colorSlotOf(axis.key));
  return (
    <button
      type="button"
      class="plot-switch"
      data-testid="plot-joint"
      aria-pressed={isPlotted.value}
      aria-label={`Plot ${axis.label}`}
      title={isPlotted.value ? "Take out of the plots" : "Plot this joint"}
      data-series={colour.value}
      onClick={() => togglePlot(axis)}
    >
      {isPlotted.value ? <span class="swatch" /> : <Icon name="plus" />}
    </button>
  );
}
