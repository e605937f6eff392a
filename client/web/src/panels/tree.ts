// The tree of a robot's links, and the load report's findings for each.
import type { Finding } from "../state/report";
import type { SceneJoint, SceneLink } from "../state/scene";

/** Returns the number of links between each link and the root. Parents come before their children. */
export function depthsOf(links: readonly SceneLink[]): number[] {
  const depths: number[] = [];
  for (const { parent } of links) depths.push(parent < 0 ? 0 : (depths[parent] ?? 0) + 1);
  return depths;
}

/**
 * Returns the findings that name the link or its joint, for instance `joint "elbow" limit`. Purely informative ones
 * appear only in the report.
 */
export function findingsOf(findings: readonly Finding[], link: string, joint: string | undefined): Finding[] {
  const isOf = ({ element, severity }: Finding): boolean =>
    severity !== "info" && (element.includes(`link "${link}"`) || (joint !== undefined && element.includes(`joint "${joint}"`)));
  return findings.filter(isOf);
}

/** Whether its values are angles. */
export function isTurning(type: SceneJoint["type"]): boolean {
  return type !== "prismatic" && type !== "planar" && type !== "floating";
}
