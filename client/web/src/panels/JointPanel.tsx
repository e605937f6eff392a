// The side panel: the joints of the selected robot, then the parameters of programs.
import { signal, useComputed } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { freeAll, holdAll } from "../daemon/actions";
import { takeOut } from "../daemon/building";
import { reports } from "../state/report";
import { degrees, fit, panelPart, selectedRobot, type PanelPart } from "../state/view";
import { ownName, whyNotRemove, whyNotRobot } from "../state/permission";
import { othersHere } from "../state/tools";
import { robots, type Axis, type Robot } from "../state/world";
import { ClaimButton } from "./ClaimButton";
import { Constraints } from "./Constraints";
import { grouped, matches } from "./groups";
import { Icon } from "./icons";
import { JointRow } from "./JointRow";
import { lazy } from "./lazy";
import { OpenFile, OpenFolder } from "./OpenFiles";
import { Name } from "./Name";
import { Parameters } from "./Parameters";
import { Popover } from "./Popover";
import { shortened } from "./quantity";
import { openReport } from "./ReportSheet";
import { Sensors } from "./Sensors";
import { shownRobot } from "./shown-robot";

// Parts that most visits never open.
const Structure = lazy(async () => (await import("./Structure")).Structure, "The structure", () => (panelPart.value = "joints"));

const filter = signal("");

/** The panel. */
export function JointPanel(): JSX.Element {
  const robot = shownRobot.value;
  const isStructure = panelPart.value === "structure";
  return (
    <div class="panel-body">
      {robots.value.length > 1 && <RobotTabs />}
      {robot && <RobotHeader key={robot.name} robot={robot} />}
      {robot && <Parts />}
      {robot && !isStructure && robot.axes.length > 0 && <JointTools />}
      <div class="panel-scroll" id="robot-panel" role={robots.value.length > 1 ? "tabpanel" : undefined} aria-label={robot?.name}>
        {robot && (isStructure ? <Structure key={robot.name} robot={robot} /> : <JointList robot={robot} />)}
        {robot && !isStructure && <Sensors key={robot.name} robot={robot.name} />}
        <Parameters />
        <Constraints />
        <div class="open-robot" role="group" aria-label="Load a robot">
          <OpenFolder class="button quiet">
            <Icon name="folder" /> Choose a folder
          </OpenFolder>
          <OpenFile class="button quiet">
            <Icon name="file" /> Choose a file
          </OpenFile>
        </div>
      </div>
    </div>
  );
}

/** One tab for each robot. */
function RobotTabs(): JSX.Element {
  const shown = shownRobot.value?.name;
  const list = useRef<HTMLDivElement>(null);
  const selected = (): HTMLElement | null => list.current?.querySelector<HTMLElement>('[aria-selected="true"]') ?? null;
  useEffect(() => selected()?.scrollIntoView({ block: "nearest", inline: "nearest" }), [shown]);
  const move = (by: number): void => {
    const names = robots.value.map(({ name }) => name);
    const next = names[(names.indexOf(shown ?? "") + by + names.length) % names.length];
    if (next === undefined) return;
    selectedRobot.value = next;
    requestAnimationFrame(() => selected()?.focus());
  };
  return (
    <div
      ref={list}
      class="tabs"
      role="tablist"
      aria-label="Robots"
      onKeyDown={(event) => {
        if (event.key === "ArrowRight") move(1);
        if (event.key === "ArrowLeft") move(-1);
      }}
    >
      {robots.value.map(({ name }, index) => (
        <button
          key={name}
          type="button"
          role="tab"
          class="tab"
          data-testid={`robot-${name}`}
          aria-selected={name === shown}
          aria-controls="robot-panel"
          tabIndex={name === shown ? 0 : -1}
          onClick={() => {
            selectedRobot.value = name;
          }}
        >
          <Name name={name} title={index < 9 ? `Show ${name} (${index + 1})` : `Show ${name}`} />
        </button>
      ))}
    </div>
  );
}

/** The summary of the robot, and actions on all of it. */
function RobotHeader({ robot }: { robot: Robot }): JSX.Element {
  const { name, model, mass, axes, disabledReason, claimedBy } = robot;
  const report = reports.value.get(name);
  const warnings = report?.findings.filter(({ severity }) => severity !== "info").length ?? 0;
  const whyNot = whyNotRobot(robot);
  const about = [model === name ? "" : model, `${axes.length} ${axes.length === 1 ? "axis" : "axes"}`, mass > 0 ? `${shortened(mass)} kg` : ""];
  return (
    <header class="robot">
      <div class="robot-line">
        {report ? (
          <button type="button" class="robot-name link" data-testid="report" title="Load report" onClick={() => openReport(name)}>
            <Name name={name} title={`Load report of ${name}`} />
            {warnings > 0 && <span class="count">{warnings}</span>}
          </button>
        ) : (
          <h2 class="robot-name">
            <Name name={name} />
          </h2>
        )}
        <button type="button" class="button quiet" aria-label={`Look at ${name}`} title={`Look at ${name}`} onClick={() => fit(name)}>
          <Icon name="fit" />
        </button>
        <ClaimButton what={name} holder={claimedBy} whyNot={whyNot} />
        {axes.some(({ actuated }) => actuated) && (
          <>
            <button type="button" class="button" data-testid="hold-all" title={whyNot || "All joints hold where they are"} disabled={whyNot !== ""} onClick={() => void holdAll(name)}>
              Hold all
            </button>
            <button type="button" class="button" data-testid="free-all" title={whyNot || "No joint is driven"} disabled={whyNot !== ""} onClick={() => void freeAll(name)}>
              Free
            </button>
          </>
        )}
        <Popover class="button quiet" face={<Icon name="remove" />} label={`Remove ${name}`} title={whyNotRemove(robot) || `Take ${name} out of the world`} disabled={whyNotRemove(robot) !== ""} testId="remove">
          {(close) => (
            <div class="ask">
              <p>
                Take <b>{name}</b> out of the world, for all clients?
                {othersHere().length > 0 && ` Also here: ${othersHere().join(", ")}.`}
              </p>
              <button
                type="button"
                class="button danger"
                onClick={() => {
                  close();
                  void takeOut(name);
                }}
              >
                Remove it
              </button>
            </div>
          )}
        </Popover>
      </div>
      <p class="about">{about.filter((part) => part !== "").join(" · ")}</p>
      {claimedBy !== "" && (
        <p class="source claimed" data-testid="robot-claimed" title="Others cannot change it">
          <Icon name="lock" />
          {claimedBy === ownName.value ? "You have claimed it" : `${claimedBy} has claimed it`}
        </p>
      )}
      {disabledReason !== "" && (
        <p class="disabled" role="status">
          <Icon name="warning" /> Disabled: {disabledReason}
        </p>
      )}
    </header>
  );
}

const PARTS: readonly { part: PanelPart; label: string; title: string }[] = [
  { part: "joints", label: "Joints", title: "What the joints do, and their targets" },
  { part: "structure", label: "Structure", title: "Links and joints with masses, inertias, limits, gains and looks (I)" },
];

/** Choice of the part of the robot that the panel shows. */
function Parts(): JSX.Element {
  return (
    <div class="segments panel-parts" role="group" aria-label="What is shown of the robot">
      {PARTS.map(({ part, label, title }) => (
        <button
          key={part}
          type="button"
          data-testid={`part-${part}`}
          aria-pressed={panelPart.value === part}
          title={title}
          onClick={() => {
            panelPart.value = part;
          }}
        >
          {label}
        </button>
      ))}
    </div>
  );
}

/** Filters of the list, and the unit of angles. */
function JointTools(): JSX.Element {
  return (
    <div class="joint-tools">
      <input
        type="search"
        class="filter"
        id="joint-filter"
        data-testid="filter"
        placeholder="Filter joints"
        aria-label="Filter joints"
        title="Show only joints with these words in their names (/)"
        autocomplete="off"
        spellcheck={false}
        value={filter}
        onInput={(event) => {
          filter.value = event.currentTarget.value;
        }}
        onKeyDown={(event) => {
          if (event.key !== "Escape") return;
          filter.value = "";
          event.currentTarget.blur();
        }}
      />
      <div class="segments" role="group" aria-label="Unit of angles">
        {(["rad", "deg"] as const).map((unit) => (
          <button
            key={unit}
            type="button"
            data-testid={unit}
            aria-pressed={degrees.value === (unit === "deg")}
            title={unit === "deg" ? "Show angles in degrees" : "Show angles in radians"}
            onClick={() => {
              degrees.value = unit === "deg";
            }}
          >
            {unit}
          </button>
        ))}
      </div>
    </div>
  );
}

/** The rows, under headings if they are many. */
function JointList({ robot }: { robot: Robot }): JSX.Element {
  const groups = useComputed(() => {
    const { axes } = shownRobot.value ?? robot;
    const found = axes.filter(({ label }) => matches(label, filter.value));
    // The filter may match the words that a heading takes from the names.
    if (filter.value.trim() !== "") return [{ heading: "", rows: found.map((item) => ({ item, label: item.label })) }];
    return grouped<Axis>(found, ({ label }) => label);
  });
  if (robot.axes.length === 0) return <p class="hint">{robot.name} has no joints that move.</p>;
  if (groups.value.every(({ rows }) => rows.length === 0)) {
    return <p class="hint">No joint of {robot.name} has “{filter}” in its name.</p>;
  }
  return (
    <>
      {groups.value.map(({ heading, rows }) =>
        heading === "" ? (
          <section key="" class="limb">
            {rows.map(({ item, label }) => (
              <JointRow key={item.key} axis={item} label={label} filter={filter.value} />
            ))}
          </section>
        ) : (
          <details key={heading} class="limb" open>
            <summary>
              <Icon name="chevron" />
              {heading}
              <span class="limb-count">{rows.length}</span>
            </summary>
            {rows.map(({ item, label }) => (
              <JointRow key={item.key} axis={item} label={label} filter={filter.value} />
            ))}
          </details>
        ),
      )}
    </>
  );
}
