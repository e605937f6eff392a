// All robots of the world: found by name, shown and hidden on this page, selected, duplicated and removed. Made for
// hundreds.
import { signal, useComputed } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import { duplicate, takeOut } from "../daemon/building";
import { Icon } from "../panels/icons";
import { shortened } from "../panels/quantity";
import { Sheet } from "../panels/Sheet";
import { whyNotAll, whyNotRemove } from "../state/permission";
import { askFirst, hiddenRobots, tool } from "../state/tools";
import { fit, selectedRobot } from "../state/view";
import { robots } from "../state/world";
import { inView, linesOf, type Line } from "./matching";

/** Height of a line, rem. */
const HEIGHT = 2.25;

const filter = signal("");
const closed = signal<ReadonlySet<string>>(new Set());

export function RobotsSheet(): JSX.Element {
  const lines = useComputed(() => linesOf(robots.value.map(({ name }) => name), filter.value, closed.value)).value;
  const hidden = hiddenRobots.value.size;
  return (
    <Sheet
      title={`Robots: ${robots.value.length}`}
      testId="robots-sheet"
      onClose={() => {
        if (tool.peek()?.kind === "robots") tool.value = null;
      }}
    >
      <div class="build-row">
        <input
          type="search"
          class="filter"
          placeholder="Filter robots"
          aria-label="Filter robots"
          data-testid="robots-filter"
          autocomplete="off"
          spellcheck={false}
          value={filter}
          onInput={(event) => {
            filter.value = event.currentTarget.value;
          }}
        />
        <button type="button" class="button" data-testid="robots-show-all" disabled={hidden === 0} onClick={() => (hiddenRobots.value = new Set())}>
          Show all{hidden > 0 ? ` (${hidden} hidden)` : ""}
        </button>
      </div>
      {lines.length === 0 && <p class="hint">{robots.value.length === 0 ? "There are no robots." : `No robot has “${filter.value}” in its name.`}</p>}
      <Lines lines={lines} />
    </Sheet>
  );
}

/** The lines that are in view, in a space as high as all. */
function Lines({ lines }: { lines: readonly Line[] }): JSX.Element {
  const box = useRef<HTMLDivElement>(null);
  const [[top, seen], setView] = useState<[number, number]>([0, 600]);
  const height = HEIGHT * parseFloat(getComputedStyle(document.documentElement).fontSize);
  const look = (): void => setView([box.current?.scrollTop ?? 0, box.current?.clientHeight ?? 600]);
  useEffect(look, [lines.length]);
  // The sheet grows when its styles arrive, and with the window.
  useEffect(() => {
    const observer = new ResizeObserver(look);
    if (box.current !== null) observer.observe(box.current);
    return () => observer.disconnect();
  }, []);
  const [first, end] = inView(top, seen, height, lines.length);
  return (
    <div ref={box} class="world-lines" tabIndex={0} role="group" aria-label="Robots" data-testid="robots-lines" onScroll={look}>
      <ul style={{ height: `${lines.length * HEIGHT}rem` }}>
        {lines.slice(first, end).map((line, index) => (
          <li key={`${line.kind} ${line.name}`} style={{ top: `${(first + index) * HEIGHT}rem` }}>
            {line.kind === "group" ? <Group line={line} /> : <RobotLine name={line.name} indented={line.indented} />}
          </li>
        ))}
      </ul>
    </div>
  );
}

function Group({ line: { name, robots: all, open } }: { line: Extract<Line, { kind: "group" }> }): JSX.Element {
  return (
    <>
      <button
        type="button"
        class="button quiet world-name"
        aria-expanded={open}
        data-testid={`robots-group-${name}`}
        onClick={() => {
          const next = new Set(closed.peek());
          if (!next.delete(name)) next.add(name);
          closed.value = next;
        }}
      >
        <Icon name="chevron" /> {name} <span class="limb-count">{all.length}</span>
      </button>
      <Eye names={all} label={`the ${all.length} of ${name}`} />
    </>
  );
}

function RobotLine({ name, indented }: { name: string; indented: boolean }): JSX.Element {
  const robot = robots.value.find((each) => each.name === name);
  const whyNot = robot ? whyNotRemove(robot) : whyNotAll.value;
  const remove = (): void => {
    tool.value = null;
    askFirst(`Remove ${name}`, `${name} is removed from the world, for everybody.`, "Remove it", () => void takeOut(name));
  };
  return (
    <>
      <button
        type="button"
        class={`button quiet world-name${indented ? " indented" : ""}`}
        aria-pressed={selectedRobot.value === name}
        title={`Show ${name} in the panel, and look at it`}
        data-testid={`robots-select-${name}`}
        onClick={() => {
          selectedRobot.value = name;
          fit(name);
        }}
      >
        {name}
      </button>
      {robot?.claimedBy !== undefined && robot.claimedBy !== "" && <Icon name="lock" />}
      <span class="hint tabular">
        {robot?.axes.length ?? 0} axes · {shortened(robot?.mass ?? 0)} kg
      </span>
      <Eye names={[name]} label={name} />
      <button type="button" class="button quiet sign" aria-label={`Duplicate ${name}`} title={whyNotAll.value || "Add another copy of it"} disabled={whyNotAll.value !== ""} onClick={() => void duplicate(name)}>
        <Icon name="copy" />
      </button>
      <button type="button" class="button quiet sign" aria-label={`Remove ${name}`} title={whyNot || "Remove it from the world"} disabled={whyNot !== ""} onClick={remove}>
        <Icon name="remove" />
      </button>
    </>
  );
}

/** Shows or hides robots on this page. */
function Eye({ names, label }: { names: readonly string[]; label: string }): JSX.Element {
  const isHidden = names.every((name) => hiddenRobots.value.has(name));
  return (
    <button
      type="button"
      class="button quiet sign"
      aria-label={`Draw ${label}`}
      aria-pressed={!isHidden}
      title={isHidden ? "Draw it on this page" : "Do not draw it on this page"}
      data-testid={`robots-eye-${names.length === 1 ? names[0] : label.split(" ").at(-1)}`}
      onClick={() => {
        const next = new Set(hiddenRobots.peek());
        for (const name of names) {
          if (isHidden) next.delete(name);
          else next.add(name);
        }
        hiddenRobots.value = next;
      }}
    >
      <Icon name="visuals" />
    </button>
  );
}
