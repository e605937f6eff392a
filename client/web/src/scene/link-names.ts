// Names beside links: of the robot in the panel, and of the link under the pointer.
import { Vector3 } from "three";
import { shownRobot } from "../panels/shown-robot";
import { hoveredLink, linkNames } from "../state/view";
import type { Label } from "./labels";
import type { RobotView } from "./robot-view";

/** Where they are drawn, world axes. */
export function namesOf(views: Iterable<RobotView>): Label[] {
  const hovered = hoveredLink.peek();
  const shown = linkNames.peek() ? shownRobot.peek()?.name : undefined;
  const labels: Label[] = [];
  for (const view of views) {
    const { robot, links } = view.scene;
    if (robot !== shown && robot !== hovered?.robot) continue;
    links.forEach(({ name }, index) => {
      if (robot === shown || name === hovered?.link) labels.push({ text: name, at: new Vector3().setFromMatrixPosition(view.worldFromLink(index)) });
    });
  }
  return labels;
}
