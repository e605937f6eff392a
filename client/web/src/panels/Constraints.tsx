// What holds links together, with its force; each can be removed.
import type { JSX } from "preact";
import { useState } from "preact/hooks";
import { deleteConstraint } from "../daemon/actions";
import { constraints, hoveredConstraint, type Constraint, type ConstraintEnd } from "../state/constraints";
import { role } from "../state/world";
import { Icon } from "./icons";
import { shortened } from "./quantity";

/** Rows before more are asked for. */
const PAGE = 50;
/** Metres, radians: less than this is what the solver leaves. */
const NOTABLE_ERROR = 1e-3;

/** All constraints of the world; nothing where there are none. */
export function Constraints(): JSX.Element | null {
  const [shown, setShown] = useState(PAGE);
  const all = constraints.value;
  if (all.length === 0) return null;
  return (
    <section class="constraints" aria-label="Constraints" data-testid="constraints">
      <h2>Constraints</h2>
      <ul>
        {all.slice(0, shown).map((each) => (
          <Row key={each.name} constraint={each} />
        ))}
      </ul>
      {all.length > shown && (
        <button type="button" class="button" onClick={() => setShown(shown + PAGE)}>
          Show more of {all.length}
        </button>
      )}
    </section>
  );
}

function Row({ constraint }: { constraint: Constraint }): JSX.Element {
  const [asks, setAsks] = useState(false);
  const { name, kind, parent, child, force, torque, maxForce, positionError, angleError, saturated } = constraint;
  const hover = (on: boolean) => () => {
    hoveredConstraint.value = on ? name : "";
  };
  const isOff = positionError > NOTABLE_ERROR || angleError > NOTABLE_ERROR;
  const limit = Number.isFinite(maxForce) ? ` of ${shortened(maxForce)} N` : "";
  return (
    <li data-testid={`constraint-${name}`} onPointerEnter={hover(true)} onPointerLeave={hover(false)}>
      <div class="constraint-line">
        <b title={name}>{name}</b>
        <span class={saturated ? "constraint-force saturated" : "constraint-force"} data-testid="constraint-force" title="Force and torque on the child over the last step">
          {shortened(size(force))} N{limit} · {shortened(size(torque))} N m
        </span>
        <button
          type="button"
          class="button quiet sign"
          data-testid="remove-constraint"
          aria-label={`Remove ${name}`}
          aria-expanded={asks}
          title="Let these links go"
          disabled={role.value === "viewer"}
          onFocus={hover(true)}
          onBlur={hover(false)}
          onClick={() => setAsks(!asks)}
        >
          <Icon name="remove" />
        </button>
      </div>
      <p class="hint">
        {kind}: {place(parent)} to {place(child)}
        {saturated && ", at its limit"}
        {isOff && `, off by ${shortened(positionError * 1e3)} mm and ${shortened(angleError)} rad`}
      </p>
      {asks && (
        <p class="recording-ask">
          Its links are let go, for everybody.
          <button type="button" class="button danger" data-testid="remove-surely" onClick={() => void deleteConstraint(name)}>
            Remove {name}
          </button>
        </p>
      )}
    </li>
  );
}

function place({ robot, link, joint }: ConstraintEnd): string {
  return robot === "" ? "the world" : `${robot}/${joint === "" ? link : joint}`;
}

function size([x, y, z]: readonly [number, number, number]): number {
  return Math.hypot(x, y, z);
}
