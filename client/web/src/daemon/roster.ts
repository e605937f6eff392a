// Which robots are in the world and what they are made of: asked for only when a robot or a layout comes or goes.
import { batch } from "@preact/signals";
import type { EntityInfo, RobotScene as WireScene } from "../gen/simd/v1/entity_pb";
import type { JointLayout } from "../gen/simd/v1/joint_pb";
import { scenes, type RobotScene } from "../state/scene";
import { robots, type Robot } from "../state/world";
import { robotOf, sceneOf } from "./mapping";
import type { Services } from "./services";

/** Layout versions by robot. */
export type Layouts = ReadonlyMap<string, bigint>;

/** Milliseconds until what could not be fetched is asked for again. */
const PATIENCE = 500;

/** Keeps `robots` and `scenes` to what the daemon has. */
export class Roster {
  private known: Layouts = new Map();
  private fetching = false;
  private notBefore = 0;

  /** `changed` is called when `layouts` are others than before. */
  constructor(
    private readonly services: Services,
    private readonly changed: () => void,
  ) {}

  /** The layouts that `robots` and `scenes` are of. */
  layouts(): Layouts {
    return this.known;
  }

  /** Fetches all of it: the daemon may be another than before. Rejects where it does not answer. */
  async load(): Promise<void> {
    await this.fetch(new Map(), new Set());
  }

  /** What a state says there is; what is not known of it is fetched. */
  async see(layouts: Layouts): Promise<void> {
    if (this.fetching || performance.now() < this.notBefore || same(this.known, layouts)) return;
    await this.try(new Set());
  }

  /** Fetches what changes without a new layout: who claimed joints of these robots, and whether any is disabled. */
  async refresh(names: ReadonlySet<string>): Promise<void> {
    if (!this.fetching) await this.try(names);
  }

  private async try(names: ReadonlySet<string>): Promise<void> {
    this.fetching = true;
    try {
      await this.fetch(this.known, names);
    } catch {
      // A robot went while it was asked for, or the daemon did: the states that follow show which.
      this.notBefore = performance.now() + PATIENCE;
    } finally {
      this.fetching = false;
    }
  }

  /** Keeps what `known` has, except that the joints of the robots in `again` are asked for again. */
  private async fetch(known: Layouts, again: ReadonlySet<string>): Promise<void> {
    const { entities } = await this.services.entities.listEntities({});
    const isKnown = (entity: EntityInfo) => known.get(entity.name) === entity.layoutVersion;
    const unknown = entities.filter((entity) => !isKnown(entity));
    const asked = entities.filter((entity) => !isKnown(entity) || again.has(entity.name));
    const [drawn, layouts] = await Promise.all([this.scenesOf(unknown), this.layoutsOf(asked)]);

    const oldRobots = new Map(robots.value.map((robot) => [robot.name, robot]));
    const newRobots: Robot[] = [];
    const newScenes = new Map<string, RobotScene>();
    for (const entity of entities) {
      const { name, layoutVersion, disabledReason } = entity;
      const layout = layouts.get(name);
      const old = oldRobots.get(name);
      const robot = layout ? robotOf(entity, layout) : old && { ...old, disabledReason };
      const wire = drawn.get(name);
      const scene = wire && layout ? sceneOf(entity, layout, wire) : scenes.value.get(name);
      // One that was reloaded between the calls is taken with the next state.
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
    const ask = ({ name }: EntityInfo) => this.services.joints.getJointLayout({ robot: name });
    const answers = await Promise.all(entities.map(ask));
    return new Map(answers.flatMap(({ layout }) => (layout ? [[layout.robot, layout]] : [])));
  }
}

function same(a: Layouts, b: Layouts): boolean {
  return a.size === b.size && [...a].every(([name, version]) => b.get(name) === version);
}
