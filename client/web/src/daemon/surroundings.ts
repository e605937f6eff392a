// What changes seldom: how the world runs, its settings, sliders, who else is here, what happened.
import { batch } from "@preact/signals";
import type { Event } from "../gen/simd/v1/event_pb";
import { clients, connection, parameters, physics, robots, simulation, targetSources } from "../state/world";
import { clientOf, parameterOf, physicsOf, simulationOf, sourcesOf } from "./mapping";
import { Punctuality } from "./punctuality";
import type { Roster } from "./roster";
import type { Services } from "./services";

/** Milliseconds between two turns. */
const INTERVAL = 500;
/** Who is here is asked each second time. */
const SELDOM = 2;
/** Seconds; 0 would be a whole second of waiting. */
const NO_WAIT = 0.001;
const CALL = { timeoutMs: 5000 };
/** After all events that there will ever be: the answer says only which was the last. */
const LAST = 2n ** 64n - 1n;

/** Asks for it, slowly, one call after the other, so that a tab takes one connection for it at most. */
export class Surroundings {
  private turns = 0;
  private parametersVersion = 0n;
  private lastEvent = 0n;
  private punctuality = new Punctuality();

  constructor(
    private readonly services: Services,
    private readonly roster: Roster,
  ) {}

  /** Forgets what was true of the daemon before, and asks for what only events bring anew. */
  async begin(): Promise<void> {
    this.turns = 0;
    this.parametersVersion = 0n;
    this.punctuality = new Punctuality();
    const [events] = await Promise.all([this.services.events.nextEvents({ afterSequence: LAST }, CALL), this.askPhysics()]);
    this.lastEvent = events.lastSequence;
  }

  /** Answers in how many milliseconds the next turn is due. */
  async turn(): Promise<number> {
    if (connection.value.state !== "live") return INTERVAL;
    const seldom = this.turns % SELDOM === 0;
    this.turns += 1;
    try {
      await this.askStatistics();
      await this.askParameters();
      await this.askEvents();
      if (seldom) await this.askClients();
    } catch {
      // Whether the daemon is there is for the states to say, which are asked for more often.
    }
    return INTERVAL;
  }

  private async askStatistics(): Promise<void> {
    const { statistics } = await this.services.simulation.getWorldStatistics({}, CALL);
    if (!statistics) return;
    const said = simulationOf(statistics);
    simulation.value = { ...said, behind: this.punctuality.judge(said) };
  }

  private async askPhysics(): Promise<void> {
    const response = await this.services.simulation.getPhysics({}, CALL);
    if (response.physics) physics.value = physicsOf(response.physics);
  }

  private async askParameters(): Promise<void> {
    const request = { afterVersion: this.parametersVersion, timeout: NO_WAIT };
    const { list } = await this.services.parameters.nextParameters(request, CALL);
    if (!list || list.version === this.parametersVersion) return;
    this.parametersVersion = list.version;
    parameters.value = list.parameters.map(parameterOf);
  }

  private async askClients(): Promise<void> {
    const response = await this.services.clients.listClients({}, CALL);
    batch(() => {
      clients.value = response.clients.map(clientOf);
      targetSources.value = sourcesOf(response.targets);
    });
  }

  private async askEvents(): Promise<void> {
    const request = { afterSequence: this.lastEvent, timeout: 0 };
    const { events, missed, lastSequence } = await this.services.events.nextEvents(request, CALL);
    this.lastEvent = lastSequence;
    const after = consequences(events);
    if (after.physicsChanged || missed > 0n) await this.askPhysics();
    if (after.robots.size > 0) await this.roster.refresh(after.robots);
  }
}

/** What has to be asked for again after these events: the settings, and which robots. */
function consequences(events: Event[]): { physicsChanged: boolean; robots: Set<string> } {
  let physicsChanged = false;
  const robots = new Set<string>();
  for (const { kind } of events) {
    switch (kind.case) {
      case "physicsChanged":
      case "snapshotRestored":
        physicsChanged = true;
        break;
      case "jointsClaimed":
      case "jointsReleased":
        for (const joint of kind.value.joints) robots.add(joint.split("/", 1)[0] ?? "");
        break;
      case "entityDisabled":
        robots.add(kind.value.robot);
        break;
      case "simulationReset":
        // It brings back robots that were disabled.
        for (const robot of disabledRobots()) robots.add(robot);
        break;
    }
  }
  return { physicsChanged, robots };
}

function disabledRobots(): string[] {
  return robots.value.filter((robot) => robot.disabledReason !== "").map((robot) => robot.name);
}
