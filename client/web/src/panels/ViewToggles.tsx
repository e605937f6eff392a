// Toggles for the layers of the view.
import type { JSX } from "preact";
import { constraints } from "../state/constraints";
import { markers } from "../state/markers";
import { sensors, sensorsShownOf } from "../state/sensors";
import { centresOfMass, collisions, constraintsShown, contacts, fit, frames, grid, inertias, jointAxes, linkNames, markersShown, pointsShown, readingsShown, visuals } from "../state/view";
import { AddGround } from "./AddGround";
import { Build } from "./Build";
import { Icon, type IconName } from "./icons";
import { ViewMenu } from "./ViewMenu";

const TOGGLES = [
  { value: visuals, icon: "visuals", label: "visual", shortcut: "V", what: "Visuals of robots" },
  { value: collisions, icon: "collisions", label: "collision", shortcut: "C", what: "Collision shapes of robots" },
  { value: frames, icon: "frames", label: "frames", shortcut: "J", what: "Frames of links: red x, green y, blue z" },
  { value: linkNames, icon: "names", label: "names", shortcut: "N", what: "Names of the links of the robot in the panel, and the holders of claims" },
  { value: jointAxes, icon: "axes", label: "axes", shortcut: "A", what: "Axes that joints turn about or slide along" },
  { value: centresOfMass, icon: "masses", label: "masses", shortcut: "M", what: "Centres of mass of links, and of each robot in red" },
  { value: inertias, icon: "inertias", label: "inertias", shortcut: "E", what: "For each link the solid ellipsoid with its mass and inertia" },
  { value: grid, icon: "grid", label: "grid", shortcut: "G", what: "The ground’s grid" },
  { value: contacts, icon: "contacts", label: "contacts", shortcut: "K", what: "Contacts of links, and their forces" },
  { value: constraintsShown, icon: "constraints", label: "constraints", shortcut: "L", what: "Constraints between links, and their forces" },
  { value: pointsShown, icon: "points", label: "points", shortcut: "U", what: "Hits of lidars and range finders, and views of cameras, for the robot in the panel" },
  { value: readingsShown, icon: "info", label: "readings", shortcut: "Q", what: "Newest readings of the robot in the panel, at its sensors" },
  { value: markersShown, icon: "markers", label: "markers", shortcut: "D", what: "Drawings of programs" },
] as const satisfies readonly { value: { value: boolean }; icon: IconName; label: string; shortcut: string; what: string }[];

/** The toggles, and the button that fits everything into the view. */
export function ViewToggles(): JSX.Element {
  return (
    <div class="view-toggles" role="group" aria-label="What is drawn">
      {TOGGLES.filter(({ value }) => hasContent(value)).map(({ value, icon, label, shortcut, what }) => (
        <button
          key={label}
          type="button"
          class="toggle"
          data-testid={`toggle-${label}`}
          aria-pressed={value.value}
          aria-label={label}
          title={`${what} (${shortcut})`}
          onClick={() => {
            value.value = !value.value;
          }}
        >
          <Icon name={icon} />
          <span class="toggle-text">{label}</span>
        </button>
      ))}
      <button type="button" class="toggle" data-testid="fit" aria-label="fit" title="Fit everything into the view (F)" onClick={() => fit()}>
        <Icon name="fit" />
        <span class="toggle-text">fit</span>
      </button>
      <ViewMenu />
      <Build />
      <AddGround />
    </div>
  );
}

/** Whether a toggle has something to show; most always have. */
function hasContent(value: { value: boolean }): boolean {
  if (value === constraintsShown) return constraints.value.length > 0;
  if (value === readingsShown) return sensors.value.some(({ robot }) => robot === sensorsShownOf.value);
  if (value === pointsShown) return sensors.value.some(({ scan, lens, robot }) => (scan ?? lens) && robot === sensorsShownOf.value);
  return value !== markersShown || markers.value.size > 0;
}
