// Shapes of recorded robots: taken from a live robot with the same links, else from its description.
import type { Ghosts } from "../state/playback";
import type { RobotScene } from "../state/scene";
import { topicPart, type RecordedState, type Timeline } from "../recording/timeline";
import { described, type Described } from "../recording/urdf";

/** Finds shapes for the robots of one recording. */
export class Casting {
  private readonly descriptions = new Map<string, Described | undefined>();
  private live: ReadonlyMap<string, RobotScene> = new Map();
  private chosen = new Map<string, RobotScene>();

  constructor(private readonly timeline: Timeline) {}

  /** Returns the ghosts that are drawn for a state together with these live robots. */
  ghosts(state: RecordedState, live: ReadonlyMap<string, RobotScene>): Ghosts {
    if (live !== this.live) this.chosen = new Map();
    this.live = live;
    const scenes = new Map<string, RobotScene>();
    const poses = new Map<string, Float64Array>();
    for (const [robot, links] of state.poses) {
      const scene = this.sceneOf(robot, links);
      const root = links.values().next().value;
      if (!root) continue;
      const flat = new Float64Array(7 * scene.links.length);
      // A link that is not recorded is drawn at its robot's root.
      scene.links.forEach(({ name }, index) => flat.set(links.get(name) ?? root, 7 * index));
      scenes.set(robot, scene);
      poses.set(robot, flat);
    }
    return { scenes, poses };
  }

  /** Returns the description of a recorded robot, if it has one. */
  description(robot: string): Described | undefined {
    const topic = topicPart(robot);
    if (!this.descriptions.has(topic)) {
      const text = this.timeline.descriptions.get(topic);
      this.descriptions.set(topic, text === undefined ? undefined : described(robot, text));
    }
    return this.descriptions.get(topic);
  }

  private sceneOf(robot: string, links: ReadonlyMap<string, unknown>): RobotScene {
    const known = this.chosen.get(robot);
    if (known && known.links.length === links.size) return known;
    const fits = (scene: RobotScene | undefined): scene is RobotScene =>
      scene !== undefined && scene.links.length === links.size && scene.links.every(({ name }) => links.has(name));
    const same = this.live.get(robot);
    const other = fits(same) ? same : [...this.live.values()].find(fits);
    const bare = { robot, layoutVersion: 0n, links: [...links.keys()].map((name) => ({ name, parent: -1, movable: true, mass: 0 })), visuals: [], collisions: [], colliders: [] };
    const scene = other ?? this.description(robot)?.scene ?? bare;
    this.chosen.set(robot, scene);
    return scene;
  }
}
