// The menu of the camera: sides to look from, projection, following, quality, and pictures.
import type { ComponentChildren, JSX } from "preact";
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
  { value: "auto", label: "Auto", what: "Shadows and reflections, if pictures come fast enough" },
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
              <Item key={viewpoint} testId={`view-${viewpoint}`} title={`Look from the ${viewpoint}${keys === "" ? "" : ` (${keys})`}`} act={() => moveCamera({ kind: "from", viewpoint })}>
                {label}
              </Item>
            ))}
          </div>
          <Item testId="orthographic" title="Parallel lines stay parallel (O)" isOn={orthographic.value} act={() => (orthographic.value = !orthographic.value)}>
            Orthographic
          </Item>
          <Item testId="side-views" title="Small views from the front, the left and above (W)" isOn={sideViews.value} act={() => (sideViews.value = !sideViews.value)}>
            Side views
          </Item>
          <Follow />
          <p class="view-heading" id="view-quality">
            Quality
          </p>
          <div class="view-sides" role="group" aria-labelledby="view-quality">
            {QUALITIES.map(({ value, label, what }) => (
              <Item key={value} testId={`quality-${value}`} title={what} isOn={quality.value === value} act={() => (quality.value = value)}>
                {label}
              </Item>
            ))}
          </div>
          <Item testId="copy-link" title="A link to this page with its camera, robot, layers and plots" act={() => (close(), void copyLink())}>
            <Icon name="copy" /> Copy link
          </Item>
          <Item testId="picture" title="Save what is shown as a PNG (S)" act={() => (close(), (pictureOpen.value = true))}>
            <Icon name="download" /> Picture …
          </Item>
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
    <Item testId="follow" title="The camera moves with the root of the robot (T)" isOn={followed.value !== ""} act={toggleFollowing}>
      Follow {name}
    </Item>
  );
}

/** A button of the menu; a toggle shows whether it is on. */
function Item({ testId, title, isOn, act, children }: { testId: string; title: string; isOn?: boolean; act: () => void; children: ComponentChildren }): JSX.Element {
  return (
    <button type="button" class="button" data-testid={testId} title={title} aria-pressed={isOn} onClick={act}>
      {children}
    </button>
  );
}
