// Robots of the world with their joints and shapes: fetched only when a robot or a layout changes.
import { batch } from "@preact/signals";
import type { EntityInfo, RobotScene as WireScene } from "../gen/simd/v1/entity_pb";
import type { JointLayout } from "../gen/simd/v1/joint_pb";
import { scenes, type RobotScene } from "../state/scene";
import { robots, type Robot } from "../state/world";
import { robotOf, sceneOf } from "./mapping";
import type { Services } from "./services";

/** Layout versions by robot. */
export type Layouts = ReadonlyMap<string, bigint>;

/** Milliseconds between a failed fetch and the next. */
const RETRY_INTERVAL = 500;

/** Keeps the signals `robots` and `scenes` up to date with the daemon. */
export class RobotRegistry {
  private known: Layouts = new Map();
  private fetching = false;
  private notBefore = 0;
  /** Robots whose joints must be fetched again: with the next fetch, since one may already be running. */
  private owed = new Set<string>();

  /** `changed` is called after each fetch: `layouts` may differ from then on. */
  constructor(
    private readonly services: Services,
    private readonly changed: () => void,
  ) {}

  /** The layout versions of `robots` and `scenes`. */
  layouts(): Layouts {
    return this.known;
  }

  /** Fetches everything, since this may be another daemon than before. Rejects if it does not answer. */
  async load(): Promise<void> {
    this.owed.clear();
    await this.fetch(new Map(), new Set());
  }

  /** Compares with the layouts of a state, and fetches new and changed ones. */
  async update(layouts: Layouts): Promise<void> {
    if (this.owed.size > 0 || !same(this.known, layouts)) await this.try();
  }

  /**
   * Fetches data that changes without a new layout: claims on joints of these robots, and whether a robot is disabled.
   */
  async refresh(names: ReadonlySet<string>): Promise<void> {
    for (const name of names) this.owed.add(name);
    await this.try();
  }

  /** Does nothing while a fetch runs, or soon after one has failed: the next state asks again. */
  private async try(): Promise<void> {
    if (this.fetching || performance.now() < this.notBefore) return;
    this.fetching = true;
    const names = this.owed;
    this.owed = new Set();
    try {
      await this.fetch(this.known, names);
    } catch {
      // A robot was deleted in the meantime, or the daemon is lost: the next states show which.
      this.notBefore = performance.now() + RETRY_INTERVAL;
      for (const name of names) this.owed.add(name);
    } finally {
      this.fetching = false;
    }
  }

  /** Reuses what is in `known`, except the joints of the robots in `again`. */
  private async fetch(known: Layouts, again: ReadonlySet<string>): Promise<void> {
    const { entities } = await this.services.entities.listEntities({});
    const isKnown = (entity: EntityInfo) => known.get(entity.name) === entity.layoutVersion;
    const unknown = entities.filter((entity) => !isKnown(entity));
    const stale = entities.filter((entity) => !isKnown(entity) || again.has(entity.name));
    const [wireScenes, layouts] = await Promise.all([this.scenesOf(unknown), this.layoutsOf(stale)]);

    const oldRobots = new Map(robots.value.map((robot) => [robot.name, robot]));
    const newRobots: Robot[] = [];
    const newScenes = new Map<string, RobotScene>();
    for (const entity of entities) {
      const { name, layoutVersion, disabledReason, claimedBy } = entity;
      const layout = layouts.get(name);
      const old = oldRobots.get(name);
      const robot = layout ? robotOf(entity, layout) : old && { ...old, disabledReason, claimedBy };
      const wire = wireScenes.get(name);
      const scene = wire && layout ? sceneOf(entity, layout, wire) : scenes.value.get(name);
      // A robot that was reloaded between the calls is fetched again with the next state.
      if (robot?.layoutVersion !== layoutVersion || scene?.layoutVersion !== layoutVersion) continue;
      newRobots.push(robot);
      newScenes.set(name, scene);
    }
    batch(() => {
      robots.value = newRobots;
      scenes.value = newScenes;
    });
    this.known = new Map(newRobots.map((robot) => [robot.name, robot.layoutVersion]));
    this.changed();
  }

  private async scenesOf(entities: EntityInfo[]): Promise<Map<string, WireScene>> {
    if (entities.length === 0) return new Map();
    const response = await this.services.entities.getScene({ robots: entities.map((entity) => entity.name) });
    return new Map(response.robots.map((scene) => [scene.robot, scene]));
  }

  private async layoutsOf(entities: EntityInfo[]): Promise<Map<string, JointLayout>> {
    const fetch = ({ name }: EntityInfo) => this.services.joints.getJointLayout({ robot: name });
    const responses = await Promise.all(entities.map(fetch));
    return new Map(responses.flatMap(({ layout }) => (layout ? [[layout.robot, layout]] : [])));
  }
}

function same(a: Layouts, b: Layouts): boolean {
  return a.size === b.size && [...a].every(([name, version]) => b.get(name) === version);
}
