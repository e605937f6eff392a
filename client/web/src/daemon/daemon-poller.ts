// Polls slow data: statistics, physics settings, parameters, clients and events.
import { batch } from "@preact/signals";
import { timestampMs } from "@bufbuild/protobuf/wkt";
import type { Event } from "../gen/simd/v1/event_pb";
import { constraints, sameConstraints } from "../state/constraints";
import { addHappenings, happenings } from "../state/happenings";
import { beingMade, recordingSince, recordingsOpen } from "../state/recordings";
import { readings, sensors, sensorsShownOf } from "../state/sensors";
import { toast } from "../state/toasts";
import { refreshClientsBy } from "../state/tools";
import { clients, connection, parameters, physics, robots, targetSources } from "../state/world";
import { constraintOf } from "./constraints";
import { wordsOf } from "./event-words";
import { clientOf, parameterOf, physicsOf, simulationOf, sourcesOf } from "./mapping";
import { LagDetector } from "./lag-detector";
import { refreshRecordings } from "./recordings";
import type { RobotRegistry } from "./robot-registry";
import { readingsOf, sensorOf } from "./sensors";
import type { Services } from "./services";
import { statisticsOfRequest } from "./set-state";

/** Milliseconds between two polls, and while the world rests. */
const INTERVAL = 500;
const RESTING_INTERVAL = 1000;
/** Minimum milliseconds between two requests for the list of clients. */
const CLIENTS_INTERVAL = 900;
/** Seconds; 0 would mean the default of one second. */
const NO_WAIT = 0.001;
const CALL = { timeoutMs: 5000 };
/** All events that the daemon still has. */
const ALL_EVENTS = 0n;

/** Makes one call after the other, so that a tab needs at most one connection for it. */
export class DaemonPoller {
  private clientsAt = -Infinity;
  private parametersVersion = 0n;
  private lastEvent = 0n;
  private lag = new LagDetector();

  constructor(
    private readonly services: Services,
    private readonly registry: RobotRegistry,
    private readonly worldRests: () => boolean,
  ) {
    refreshClientsBy(() => this.fetchClients());
  }

  /** Forgets the former daemon's state, and fetches data that later depends on events. Resolves to whether its events restarted. */
  async begin(): Promise<boolean> {
    this.clientsAt = -Infinity;
    this.parametersVersion = 0n;
    this.lag = new LagDetector();
    const [events] = await Promise.all([this.services.events.nextEvents({ afterSequence: ALL_EVENTS }, CALL), this.fetchPhysics()]);
    const isAnother = events.lastSequence < this.lastEvent;
    this.lastEvent = events.lastSequence;
    happenings.value = [];
    tell(events.events);
    // Errors of the folder are shown with the list.
    await this.fetchRecordings().catch(() => undefined);
    await this.fetchConstraints().catch(() => undefined);
    await this.fetchSensors().catch(() => undefined);
    return isAnother;
  }

  /** Returns the milliseconds until the next poll. */
  async poll(): Promise<number> {
    if (connection.value.state !== "live") return INTERVAL;
    const now = performance.now();
    const withClients = now - this.clientsAt >= CLIENTS_INTERVAL;
    if (withClients) this.clientsAt = now;
    try {
      await this.fetchStatistics();
      await this.fetchParameters();
      await this.fetchEvents();
      // Their forces change.
      if (constraints.value.length > 0) await this.fetchConstraints();
      await this.fetchReadings();
      if (withClients) await this.fetchClients();
      // Its size grows.
      if (withClients && (beingMade.value || recordingsOpen.value)) await this.fetchRecordings();
    } catch {
      // A lost daemon is detected by the poll of states, which is more frequent.
    }
    return this.worldRests() && !this.showsSensors() ? RESTING_INTERVAL : INTERVAL;
  }

  /** Whether the robot in the panel has sensors, whose readings change in a world at rest, too. */
  private showsSensors(): boolean {
    const robot = sensorsShownOf.value;
    return sensors.value.some((sensor) => sensor.robot === robot);
  }

  private async fetchStatistics(): Promise<void> {
    const show = statisticsOfRequest();
    const { statistics } = await this.services.simulation.getWorldStatistics({}, CALL);
    if (!statistics) return;
    const reported = simulationOf(statistics);
    show({ ...reported, behind: this.lag.update(reported) });
  }

  private async fetchPhysics(): Promise<void> {
    const response = await this.services.simulation.getPhysics({}, CALL);
    if (response.physics) physics.value = physicsOf(response.physics);
  }

  private async fetchParameters(): Promise<void> {
    const request = { afterVersion: this.parametersVersion, timeout: NO_WAIT };
    const { list } = await this.services.parameters.nextParameters(request, CALL);
    if (!list || list.version === this.parametersVersion) return;
    this.parametersVersion = list.version;
    parameters.value = list.parameters.map(parameterOf);
  }

  private async fetchClients(): Promise<void> {
    const response = await this.services.clients.listClients({}, CALL);
    batch(() => {
      clients.value = response.clients.map(clientOf);
      targetSources.value = sourcesOf(response.targets);
    });
  }

  private async fetchConstraints(): Promise<void> {
    const response = await this.services.constraints.listConstraints({}, CALL);
    const next = response.constraints.map(constraintOf);
    // Forces that differ by the solver's residual cause no new picture.
    if (!sameConstraints(constraints.peek(), next)) constraints.value = next;
  }

  private async fetchSensors(): Promise<void> {
    const response = await this.services.sensors.listSensors({}, CALL);
    sensors.value = response.sensors.map(sensorOf);
  }

  /** Measurements of the robot in the panel, if it has sensors. The poller does not wait for them. */
  private async fetchReadings(): Promise<void> {
    if (!this.showsSensors()) return;
    const robot = sensorsShownOf.value;
    const request = { selections: [{ robot }], timeout: NO_WAIT };
    const response = await this.services.sensors.getSensorReadings(request, CALL);
    if (sensorsShownOf.value === robot) readings.value = readingsOf(response.sensors);
  }

  private fetchRecordings(): Promise<void> {
    return refreshRecordings(this.services);
  }

  private async fetchEvents(): Promise<void> {
    const request = { afterSequence: this.lastEvent, timeout: 0 };
    const { events, missed, lastSequence } = await this.services.events.nextEvents(request, CALL);
    this.lastEvent = lastSequence;
    for (const { text, isWarning } of tell(events)) {
      if (isWarning) toast("error", `${text}.`);
    }
    const stale = staleAfter(events);
    if (stale.physics || missed > 0n) await this.fetchPhysics();
    if (stale.robots.size > 0) await this.registry.refresh(stale.robots);
    if (stale.constraints || missed > 0n) await this.fetchConstraints();
    if (stale.sensors || missed > 0n) await this.fetchSensors();
    if (stale.recordings || missed > 0n) await this.fetchRecordings();
  }
}

/** Appends events, in words, to the recent ones, and returns them. */
function tell(events: Event[]): { text: string; isWarning: boolean }[] {
  const described = events.map((event) => ({ sequence: event.sequence, simTime: event.stamp?.simTime ?? 0, ...wordsOf(event) }));
  addHappenings(described);
  for (const { kind, stamp } of events) {
    if (kind.case === "recordingStarted") recordingSince.value = stamp?.wallTime ? timestampMs(stamp.wallTime) : null;
  }
  return described;
}

/** Data that must be fetched again after these events: physics settings, constraints, sensors, recordings, and the list of robots. */
function staleAfter(events: Event[]): { physics: boolean; constraints: boolean; sensors: boolean; recordings: boolean; robots: Set<string> } {
  let physics = false;
  let constraints = false;
  let sensors = false;
  let recordings = false;
  const robots = new Set<string>();
  for (const { kind } of events) {
    switch (kind.case) {
      case "stateRestored":
        physics = true;
        constraints = true;
        sensors = true;
        break;
      case "physicsChanged":
        physics = true;
        break;
      case "constraintCreated":
      case "constraintDeleted":
        constraints = true;
        break;
      // Sensors of descriptions come and go with their robots.
      case "sensorCreated":
      case "sensorDeleted":
      case "entitySpawned":
      case "entityDeleted":
      case "entityReloaded":
        sensors = true;
        break;
      case "recordingStarted":
      case "recordingEnded":
        recordings = true;
        break;
      case "jointsClaimed":
      case "jointsReleased":
        for (const robot of kind.value.robots) robots.add(robot);
        for (const joint of kind.value.joints) robots.add(joint.split("/", 1)[0] ?? "");
        break;
      case "entityDisabled":
        robots.add(kind.value.robot);
        break;
      case "simulationReset":
        constraints = true;
        sensors = true;
        // A reset enables disabled robots again.
        for (const robot of disabledRobots()) robots.add(robot);
        break;
    }
  }
  return { physics, constraints, sensors, recordings, robots };
}

function disabledRobots(): string[] {
  return robots.value.filter((robot) => robot.disabledReason !== "").map((robot) => robot.name);
}
