// Labels beside links: names of the panel's robot with the holders of its claims, the link under the pointer, and the latest
// measurements.
import { Vector3 } from "three";
import { shownRobot } from "../panels/shown-robot";
import { words } from "../panels/sensor-words";
import { readings, sensors } from "../state/sensors";
import { hoveredLink, linkNames, readingsShown } from "../state/view";
import type { Robot } from "../state/world";
import type { Label } from "./labels";
import type { RobotView } from "./robot-view";

/** Returns labels at the drawn positions, world axes. */
export function namesOf(views: Iterable<RobotView>): Label[] {
  const hovered = hoveredLink.peek();
  const robot = shownRobot.peek();
  const labels: Label[] = [];
  for (const view of views) {
    const isShown = view.scene.robot === robot?.name;
    const isNamed = isShown && linkNames.peek();
    if (isNamed || view.scene.robot === hovered?.robot) {
      view.scene.links.forEach(({ name }, index) => {
        if (isNamed || name === hovered?.link) labels.push({ text: isNamed && robot ? withHolder(name, index, robot) : name, at: placeOf(view, index) });
      });
    }
    if (isShown && readingsShown.peek()) labels.push(...readingsOf(view));
  }
  return labels;
}

/** Returns a link's name with the client that has claimed the robot (at its root), or with the joint that moves the link. */
function withHolder(name: string, index: number, { claimedBy, axes }: Robot): string {
  const holder = index === 0 && claimedBy !== "" ? claimedBy : (axes.find(({ childLink }) => childLink === name)?.claimedBy ?? "");
  return holder === "" ? name : `${name} · claimed by ${holder}`;
}

/** Returns the newest reading of each sensor of a robot, one below the other at the same link. */
function readingsOf(view: RobotView): Label[] {
  const texts = new Map<number, string[]>();
  for (const { robot, name, on } of sensors.peek()) {
    const measured = robot === view.scene.robot ? readings.peek().get(name) : undefined;
    if (!measured) continue;
    const link = view.scene.joints?.find((joint) => joint.name === on)?.child ?? on;
    const index = link === "" ? 0 : view.scene.links.findIndex((each) => each.name === link);
    if (index >= 0) texts.set(index, [...(texts.get(index) ?? []), `${name}: ${words(measured)}`]);
  }
  return [...texts].map(([index, lines]) => ({ text: lines.join("\n"), at: placeOf(view, index) }));
}

function placeOf(view: RobotView, index: number): Vector3 {
  return new Vector3().setFromMatrixPosition(view.worldFromLink(index));
}
