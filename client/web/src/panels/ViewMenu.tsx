// The menu of the camera: sides to look from, projection, following, quality, and pictures.
import type { JSX } from "preact";
import { followed, moveCamera, orthographic, quality, sideViews, type Quality, type Viewpoint } from "../state/view";
import { Icon } from "./icons";
import { copy } from "../state/clipboard";
import { linkTo } from "../state/link";
import { pictureOpen } from "../state/picture";
import { toast } from "../state/toasts";
import { Popover } from "./Popover";
import { toggleFollowing } from "./shortcuts";
import { shownRobot } from "./shown-robot";

const SIDES: readonly { viewpoint: Viewpoint; label: string; keys: string }[] = [
  { viewpoint: "front", label: "Front", keys: "X" },
  { viewpoint: "back", label: "Back", keys: "Shift + X" },
  { viewpoint: "left", label: "Left", keys: "Y" },
  { viewpoint: "right", label: "Right", keys: "Shift + Y" },
  { viewpoint: "top", label: "Top", keys: "Z" },
  { viewpoint: "bottom", label: "Bottom", keys: "Shift + Z" },
  { viewpoint: "corner", label: "Corner", keys: "" },
];

const QUALITIES: readonly { value: Quality; label: string; what: string }[] = [
  { value: "auto", label: "Auto", what: "Shadows and reflections, where pictures come fast enough" },
  { value: "low", label: "Low", what: "No shadows, no reflections, fewer pixels" },
  { value: "high", label: "High", what: "Shadows and reflections, however slow" },
];

/** A button among the toggles, with its menu. */
export function ViewMenu(): JSX.Element {
  return (
    <Popover
      class="toggle"
      testId="view-menu"
      label="camera"
      title="Camera: sides, projection, following, pictures"
      face={
        <>
          <Icon name="camera" />
          <span class="toggle-text">camera</span>
        </>
      }
    >
      {(close) => (
        <div class="view-menu">
          <div class="view-sides" role="group" aria-label="Look from">
            {SIDES.map(({ viewpoint, label, keys }) => (
              <button
                key={viewpoint}
                type="button"
                class="button"
                data-testid={`view-${viewpoint}`}
                title={`Look from the ${viewpoint}${keys === "" ? "" : ` (${keys})`}`}
                onClick={() => moveCamera({ kind: "from", viewpoint })}
              >
                {label}
              </button>
            ))}
          </div>
          <button type="button" class="button" data-testid="orthographic" aria-pressed={orthographic.value} title="Parallel lines stay parallel (O)" onClick={() => (orthographic.value = !orthographic.value)}>
            Orthographic
          </button>
          <button type="button" class="button" data-testid="side-views" aria-pressed={sideViews.value} title="Small views from the front, the left and above (W)" onClick={() => (sideViews.value = !sideViews.value)}>
            Side views
          </button>
          <Follow />
          <p class="view-heading" id="view-quality">
            Quality
          </p>
          <div class="view-sides" role="group" aria-labelledby="view-quality">
            {QUALITIES.map(({ value, label, what }) => (
              <button key={value} type="button" class="button" data-testid={`quality-${value}`} aria-pressed={quality.value === value} title={what} onClick={() => (quality.value = value)}>
                {label}
              </button>
            ))}
          </div>
          <button
            type="button"
            class="button"
            data-testid="copy-link"
            title="A link to this page with its camera, robot, layers and plots"
            onClick={() => {
              close();
              void copyLink();
            }}
          >
            <Icon name="copy" /> Copy link
          </button>
          <button
            type="button"
            class="button"
            data-testid="picture"
            title="Save what is shown as a PNG (S)"
            onClick={() => {
              close();
              pictureOpen.value = true;
            }}
          >
            <Icon name="download" /> Picture …
          </button>
        </div>
      )}
    </Popover>
  );
}

async function copyLink(): Promise<void> {
  const link = linkTo(location.href, shownRobot.peek()?.name ?? "");
  if (await copy(link, "The link")) toast("info", "The link is copied: it shows this page with its camera, robot, layers and plots.");
}

function Follow(): JSX.Element | null {
  const name = followed.value || shownRobot.value?.name;
  if (name === undefined) return null;
  return (
    <button type="button" class="button" data-testid="follow" aria-pressed={followed.value !== ""} title="The camera goes along with the root of the robot (T)" onClick={toggleFollowing}>
      Follow {name}
    </button>
  );
}
