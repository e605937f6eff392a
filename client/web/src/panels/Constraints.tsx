// Constraints between links, with their forces; each can be removed.
import type { JSX } from "preact";
import { useState } from "preact/hooks";
import { deleteConstraint } from "../daemon/actions";
import { constraints, hoveredConstraint, type Constraint, type ConstraintEnd } from "../state/constraints";
import { constraintsShown } from "../state/view";
import { whyNotChange } from "../state/permission";
import { meaning, offBy, reading, undrawn } from "./constraint-words";
import { Icon } from "./icons";

/** Number of rows until the user asks for more. */
const PAGE = 50;
/** Metres, radians: smaller values are the solver's residual. */
const NOTABLE_ERROR = 1e-3;

/** All constraints of the world; nothing without any. */
export function Constraints(): JSX.Element | null {
  const [shown, setShown] = useState(PAGE);
  const all = constraints.value;
  if (all.length === 0) return null;
  const note = constraintsShown.value ? undrawn(all.length) : "";
  return (
    <section class="constraints" aria-label="Constraints" data-testid="constraints">
      <h2>Constraints</h2>
      {note !== "" && (
        <p class="hint" data-testid="constraints-undrawn">
          {note}
        </p>
      )}
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
  const { name, kind, parent, child, positionError, angleError, saturated } = constraint;
  const hover = (on: boolean) => () => {
    hoveredConstraint.value = on ? name : "";
  };
  const isOff = positionError > NOTABLE_ERROR || angleError > NOTABLE_ERROR;
  return (
    <li data-testid={`constraint-${name}`} onPointerEnter={hover(true)} onPointerLeave={hover(false)}>
      <div class="constraint-line">
        <b title={name}>{name}</b>
        <span class={saturated ? "constraint-force saturated" : "constraint-force"} data-testid="constraint-force" title={meaning(constraint)}>
          {reading(constraint)}
        </span>
        <button
          type="button"
          class="button quiet sign"
          data-testid="remove-constraint"
          aria-label={`Remove ${name}`}
          aria-expanded={asks}
          title={whyNotChange.value || "Remove this constraint"}
          disabled={whyNotChange.value !== ""}
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
        {isOff && `, off by ${offBy(constraint)}`}
      </p>
      {asks && (
        <p class="recording-ask">
          It is removed, for everybody.
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
