// The connection against a stub of a daemon: its calls, their frequency, and its recovery from a loss.
import { create } from "@bufbuild/protobuf";
import { Code, ConnectError, createRouterTransport } from "@connectrpc/connect";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { ClientService } from "../gen/simd/v1/client_pb";
import { EntityService } from "../gen/simd/v1/entity_pb";
import { EventService } from "../gen/simd/v1/event_pb";
import { JointService, NextJointStatesResponseSchema, type NextJointStatesRequest } from "../gen/simd/v1/joint_pb";
import { ParameterService } from "../gen/simd/v1/parameter_pb";
import { SimulationService } from "../gen/simd/v1/simulation_pb";
import { pictureInterval } from "../state/picture";
import { restarted } from "../state/restart";
import { scenes } from "../state/scene";
import { contacts } from "../state/view";
import { connection, daemonName, frame, robots, simulation } from "../state/world";
import { loadAgain, remember } from "./again";
import { DaemonConnection } from "./daemon-connection";
import { servicesOver } from "./services";

/** A world whose states the test publishes. */
class World {
  alive = true;
  sequence = 1n;
  /** Number of events. */
  events = 5n;
  /** Layout versions by name. */
  robots = new Map([["arm", 1n]]);
  /** While playing, each state is a new one. */
  playing = false;
  /** Whether its joints move while it plays. */
  moving = true;
  private position = 0;
  /** Answers to calls for states are held up. */
  silent = false;
  readonly calls: string[] = [];
  readonly asked: NextJointStatesRequest[] = [];

  count(name: string): number {
    return this.calls.filter((call) => call === name).length;
  }

  private heard(name: string): void {
    this.calls.push(name);
    if (!this.alive) throw new ConnectError("HTTP 502", Code.Unavailable);
  }

  readonly services = servicesOver(
    createRouterTransport(({ service }) => {
      service(SimulationService, {
        getSimulatorInfo: () => (this.heard("info"), { name: "lab" }),
        getWorldStatistics: () => (this.heard("statistics"), { statistics: { state: 2, targetRealTimeFactor: 1, realTimeFactor: 1 } }),
        getPhysics: () => (this.heard("physics"), { physics: { timeStep: 0.001 } }),
      });
      service(EntityService, {
        listEntities: () => (this.heard("entities"), { entities: [...this.robots].map(([name, layoutVersion]) => ({ name, layoutVersion, links: [{ name: "base" }] })) }),
        getScene: ({ robots }) => (this.heard("scene"), { robots: robots.map((robot) => ({ robot, layoutVersion: this.robots.get(robot) ?? 0n })) }),
      });
      service(JointService, {
        getJointLayout: ({ robot }) => (this.heard("layout"), { layout: { robot, layoutVersion: this.robots.get(robot) ?? 0n } }),
        nextJointStates: (request) => {
          this.heard("states");
          this.asked.push(request);
          if (this.silent) return new Promise(() => undefined);
          if (this.playing) this.sequence += 1n;
          if (this.playing && this.moving) this.position += 0.01;
          const unchanged = (request.changesSince ?? 0n) > 0n && !(this.playing && this.moving);
          const values = unchanged ? { unchanged } : { position: [this.position] };
          return create(NextJointStatesResponseSchema, {
            states: { stamp: { sequence: this.sequence }, robots: [...this.robots].map(([robot, layoutVersion]) => ({ robot, layoutVersion, ...values })) },
          });
        },
      });
      service(ParameterService, { nextParameters: () => (this.heard("parameters"), { list: { version: 1n } }) });
      service(EventService, { nextEvents: () => (this.heard("events"), { lastSequence: this.events }) });
      service(ClientService, { listClients: () => (this.heard("clients"), {}) });
    }),
  );
}

let world: World;
let daemonConnection: DaemonConnection;

beforeEach(() => {
  vi.useFakeTimers();
  connection.value = { state: "connecting", reason: "", retryAt: 0 };
  robots.value = [];
  scenes.value = new Map();
  frame.value = null;
  world = new World();
  daemonConnection = new DaemonConnection(world.services);
});

afterEach(() => {
  daemonConnection.setVisible(false);
  vi.useRealTimers();
});

test("a daemon that answers is live, with its robots and their state", async () => {
  daemonConnection.setVisible(true);
  await vi.advanceTimersByTimeAsync(100);
  expect(connection.value.state).toBe("live");
  expect(daemonName.value).toBe("lab");
  expect(robots.value.map((robot) => robot.name)).toEqual(["arm"]);
  expect([...scenes.value.keys()]).toEqual(["arm"]);
  expect([...(frame.value?.joints.keys() ?? [])]).toEqual(["arm"]);
});

test("robots of this page that a restart of the daemon ended are offered again, and none after a lost connection", async () => {
  const again: string[] = [];
  for (const name of ["arm", "crate"]) remember(name, async () => again.push(name));
  world.robots.set("crate", 2n).set("of another client", 3n);
  daemonConnection.setVisible(true);
  await vi.advanceTimersByTimeAsync(1000);
  const lose = async (): Promise<void> => {
    world.alive = false;
    await vi.advanceTimersByTimeAsync(1000);
    expect(connection.value.state).toBe("lost");
    world.alive = true;
  };
  await lose();
  // Another client has removed it meanwhile.
  world.robots.delete("crate");
  await vi.advanceTimersByTimeAsync(10_000);
  expect(connection.value.state).toBe("live");
  expect(restarted.value).toBeNull();
  world.robots.set("crate", 4n);
  await vi.advanceTimersByTimeAsync(2000);
  await lose();
  world.events = 1n;
  world.robots = new Map([["crate", 1n]]);
  await vi.advanceTimersByTimeAsync(10_000);
  // The page offers no files that the daemon has, and none that this page has not loaded.
  expect(restarted.value?.robots).toEqual(["arm"]);
  await loadAgain();
  expect(again).toEqual(["arm"]);
  expect(restarted.value).toBeNull();
});

test("a playing world is polled at most sixty times a second", async () => {
  world.playing = true;
  daemonConnection.setVisible(true);
  await vi.advanceTimersByTimeAsync(1000);
  const before = world.count("states");
  await vi.advanceTimersByTimeAsync(2000);
  const rate = (world.count("states") - before) / 2;
  expect(rate).toBeLessThanOrEqual(61);
  expect(rate).toBeGreaterThan(50);
  expect(world.asked.at(-1)).toMatchObject({ timeout: 0.02, returnLinkPoses: true, returnContacts: false });
});

test("a page that draws five pictures a second asks for ten states, since more would only take time from its pictures", async () => {
  pictureInterval.value = 200;
  world.playing = true;
  daemonConnection.setVisible(true);
  await vi.advanceTimersByTimeAsync(1000);
  const before = world.count("states");
  await vi.advanceTimersByTimeAsync(2000);
  expect((world.count("states") - before) / 2).toBeCloseTo(10, 0);
  pictureInterval.value = 0;
});

test("values of a robot that has not changed are those of the state before", async () => {
  world.playing = true;
  daemonConnection.setVisible(true);
  await vi.advanceTimersByTimeAsync(500);
  world.moving = false;
  const seen = frame.value?.sequence ?? 0n;
  await vi.advanceTimersByTimeAsync(500);
  const [before, last] = world.asked.slice(-2);
  expect((last?.changesSince ?? 0n) - (before?.changesSince ?? 0n)).toBe(1n);
  const position = frame.value?.joints.get("arm")?.position;
  expect(frame.value?.sequence).toBeGreaterThan(seen);
  expect(position?.length).toBe(1);
  // Another layout: earlier knowledge of the robot is void.
  const asked = world.asked.length;
  world.robots.set("arm", 2n);
  await vi.advanceTimersByTimeAsync(1000);
  expect(frame.value?.joints.get("arm")?.position).toEqual(position);
  expect(world.asked.slice(asked).map((request) => request.changesSince)).toContain(0n);
  // A page that becomes visible again knows nothing about the daemon that runs by then.
  daemonConnection.setVisible(false);
  await vi.advanceTimersByTimeAsync(1000);
  const hidden = world.asked.length;
  daemonConnection.setVisible(true);
  await vi.advanceTimersByTimeAsync(100);
  expect(world.asked[hidden]?.changesSince).toBe(0n);
});

test("a world that plays and in which nothing moves is polled four times a second, until something moves", async () => {
  world.playing = true;
  world.moving = false;
  daemonConnection.setVisible(true);
  await vi.advanceTimersByTimeAsync(2000);
  const before = world.count("states");
  await vi.advanceTimersByTimeAsync(5000);
  expect(world.count("states") - before).toBe(20);
  world.moving = true;
  await vi.advanceTimersByTimeAsync(200);
  const moving = world.count("states");
  await vi.advanceTimersByTimeAsync(1000);
  expect(world.count("states") - moving).toBeGreaterThan(50);
});

test("a change by this page to a still world is shown at full rate", async () => {
  world.playing = true;
  world.moving = false;
  daemonConnection.setVisible(true);
  await vi.advanceTimersByTimeAsync(2000);
  const before = world.count("states");
  daemonConnection.pollNow();
  await vi.advanceTimersByTimeAsync(250);
  expect(world.count("states") - before).toBeGreaterThan(12);
});

test("an idle world is polled four times a second, with calls that return at once", async () => {
  daemonConnection.setVisible(true);
  await vi.advanceTimersByTimeAsync(2000);
  const before = world.count("states");
  await vi.advanceTimersByTimeAsync(5000);
  expect(world.count("states") - before).toBe(20);
  expect(world.asked.at(-1)?.timeout).toBeLessThanOrEqual(0.001);
});

test("an idle world is polled at full rate as soon as it moves again", async () => {
  daemonConnection.setVisible(true);
  await vi.advanceTimersByTimeAsync(2000);
  world.playing = true;
  await vi.advanceTimersByTimeAsync(250);
  const before = world.count("states");
  await vi.advanceTimersByTimeAsync(500);
  expect(world.count("states") - before).toBeGreaterThan(25);
});

test("a change by this page to an idle world is shown at once", async () => {
  daemonConnection.setVisible(true);
  await vi.advanceTimersByTimeAsync(2000);
  world.sequence += 1n;
  daemonConnection.pollNow();
  await vi.advanceTimersByTimeAsync(1);
  expect(frame.value?.sequence).toBe(world.sequence);
});

test("contacts of an idle world are fetched when they are switched on, also during a call", async () => {
  daemonConnection.setVisible(true);
  await vi.advanceTimersByTimeAsync(2000);
  const before = frame.value;
  daemonConnection.pollNow();
  contacts.value = true;
  await vi.advanceTimersByTimeAsync(50);
  contacts.value = false;
  expect(world.asked.some((request) => request.returnContacts && request.afterSequence === 0n)).toBe(true);
  expect(frame.value).not.toBe(before);
});

test("a hidden page makes no calls", async () => {
  world.playing = true;
  daemonConnection.setVisible(true);
  await vi.advanceTimersByTimeAsync(1000);
  daemonConnection.setVisible(false);
  await vi.advanceTimersByTimeAsync(100);
  const before = world.calls.length;
  await vi.advanceTimersByTimeAsync(60_000);
  expect(world.calls.length).toBe(before);
  daemonConnection.setVisible(true);
  await vi.advanceTimersByTimeAsync(50);
  expect(world.calls.length).toBeGreaterThan(before);
});

test("scenes and layouts are fetched only when a robot or a layout changes", async () => {
  world.playing = true;
  daemonConnection.setVisible(true);
  await vi.advanceTimersByTimeAsync(3000);
  expect([world.count("entities"), world.count("scene"), world.count("layout")]).toEqual([1, 1, 1]);
  world.robots.set("leg", 2n);
  await vi.advanceTimersByTimeAsync(1000);
  expect([world.count("entities"), world.count("scene"), world.count("layout")]).toEqual([2, 2, 2]);
  expect(robots.value.map((robot) => robot.name)).toEqual(["arm", "leg"]);
  const kept = scenes.value.get("leg");
  world.robots.set("arm", 3n);
  await vi.advanceTimersByTimeAsync(1000);
  expect(robots.value[0]?.layoutVersion).toBe(3n);
  expect(scenes.value.get("leg")).toBe(kept);
  world.robots.delete("arm");
  await vi.advanceTimersByTimeAsync(1000);
  expect(robots.value.map((robot) => robot.name)).toEqual(["leg"]);
  expect(world.count("layout")).toBe(3);
});

test("statistics, parameters and clients are polled slowly, and more slowly in a world at rest", async () => {
  world.playing = true;
  daemonConnection.setVisible(true);
  await vi.advanceTimersByTimeAsync(1000);
  const counts = async () => {
    const before = ["statistics", "parameters", "clients"].map((name) => world.count(name));
    await vi.advanceTimersByTimeAsync(10_000);
    return ["statistics", "parameters", "clients"].map((name, index) => world.count(name) - (before[index] ?? 0));
  };
  expect(await counts()).toEqual([20, 20, 10]);
  world.moving = false;
  await vi.advanceTimersByTimeAsync(2000);
  expect(await counts()).toEqual([10, 10, 10]);
  // Another client has started it: the page asks at once whether it plays.
  const before = world.count("statistics");
  world.moving = true;
  await vi.advanceTimersByTimeAsync(300);
  expect(world.count("statistics")).toBeGreaterThan(before);
  expect(simulation.value.state).toBe("playing");
});

test("a lost daemon is reported and retried with growing delays, and the last state stays", async () => {
  world.playing = true;
  daemonConnection.setVisible(true);
  await vi.advanceTimersByTimeAsync(1000);
  world.alive = false;
  const last = frame.value;
  await vi.advanceTimersByTimeAsync(100);
  expect(connection.value).toMatchObject({ state: "lost", reason: "The daemon does not answer." });
  expect(connection.value.retryAt).toBeGreaterThan(performance.now());
  await vi.advanceTimersByTimeAsync(30_000);
  const before = world.calls.length;
  await vi.advanceTimersByTimeAsync(50_000);
  expect(world.calls.length - before).toBe(10);
  expect(robots.value.length).toBe(1);
  expect(frame.value?.sequence).toBeGreaterThanOrEqual(last?.sequence ?? 0n);
});

test("a call that a slow picture of the page held up does not mean that the daemon is lost", async () => {
  daemonConnection.setVisible(true);
  await vi.advanceTimersByTimeAsync(1000);
  world.silent = true;
  await vi.advanceTimersByTimeAsync(4000);
  // The page draws for more than a second, in which no timer runs.
  const now = performance.now.bind(performance);
  const clock = vi.spyOn(performance, "now").mockImplementation(() => now() + 1500);
  await vi.advanceTimersByTimeAsync(1500);
  expect(connection.value.state).toBe("live");
  clock.mockRestore();
  // The next call is not answered either, though nothing held it up.
  const reasons: string[] = [];
  const end = connection.subscribe(({ reason }) => void reasons.push(reason));
  await vi.advanceTimersByTimeAsync(6000);
  end();
  expect(reasons).toContain("The daemon did not answer in time.");
});

test("a daemon that comes back with other robots and a smaller sequence is shown as it is", async () => {
  world.playing = true;
  daemonConnection.setVisible(true);
  await vi.advanceTimersByTimeAsync(1000);
  world.alive = false;
  await vi.advanceTimersByTimeAsync(1000);
  world.alive = true;
  world.sequence = 1n;
  // The version equals the arm's former one, which means nothing: the daemon counts from one again.
  world.robots = new Map([["dog", 1n]]);
  await vi.advanceTimersByTimeAsync(6000);
  expect(connection.value.state).toBe("live");
  expect(robots.value.map((robot) => robot.name)).toEqual(["dog"]);
  expect([...(frame.value?.joints.keys() ?? [])]).toEqual(["dog"]);
});

test("a daemon that was replaced between two calls is detected by its smaller sequence", async () => {
  world.playing = true;
  daemonConnection.setVisible(true);
  await vi.advanceTimersByTimeAsync(1000);
  world.sequence = 1n;
  const before = world.count("info");
  await vi.advanceTimersByTimeAsync(500);
  expect(world.count("info")).toBe(before + 1);
  expect(connection.value.state).toBe("live");
});

test("a retry reconnects to a lost daemon at once", async () => {
  daemonConnection.setVisible(true);
  await vi.advanceTimersByTimeAsync(1000);
  world.alive = false;
  await vi.advanceTimersByTimeAsync(20_000);
  world.alive = true;
  daemonConnection.retry();
  await vi.advanceTimersByTimeAsync(20);
  expect(connection.value.state).toBe("live");
});
