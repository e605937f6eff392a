// A daemon as a process, on a free port of the loopback address, with clients of its services.

import { type ChildProcess, spawn } from "node:child_process";
import { once } from "node:events";
import { existsSync } from "node:fs";
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { resolve } from "node:path";
import { createInterface } from "node:readline";

import { createClient, type Interceptor } from "@connectrpc/connect";
import { createConnectTransport } from "@connectrpc/connect-web";
import { vi } from "vitest";

import { API_VERSION } from "../src/daemon/version";
import { CameraService } from "../src/gen/simd/v1/camera_pb";
import { ConstraintService } from "../src/gen/simd/v1/constraint_pb";
import { ContactService } from "../src/gen/simd/v1/contact_pb";
import { EntityService } from "../src/gen/simd/v1/entity_pb";
import { JointService } from "../src/gen/simd/v1/joint_pb";
import { ParameterService } from "../src/gen/simd/v1/parameter_pb";
import { RecordingService } from "../src/gen/simd/v1/recording_pb";
import { SensorService } from "../src/gen/simd/v1/sensor_pb";
import { SimulationService } from "../src/gen/simd/v1/simulation_pb";
import { ViewService } from "../src/gen/simd/v1/view_pb";

/** The root of the repository. */
export const REPOSITORY = resolve(import.meta.dirname, "../../..");

/** The daemon. */
export const BINARY = process.env.SIMD_BINARY ?? resolve(REPOSITORY, "target/debug/simd");

const identify: Interceptor = (next) => (request) => {
  request.header.set("simd-api-version", API_VERSION);
  request.header.set("simd-client", "test");
  return next(request);
};

/** A daemon. `stop` or `kill` ends it. */
export class Daemon {
  readonly simulation;
  readonly joints;
  readonly entities;
  readonly parameters;
  readonly contacts;
  readonly cameras;
  readonly constraints;
  readonly recordings;
  readonly sensors;
  readonly view;

  private calls: ReturnType<typeof setInterval> | undefined;

  private constructor(
    /** `http://127.0.0.1:PORT`. */
    readonly url: string,
    private readonly child: ChildProcess,
    private readonly home: string,
  ) {
    // JSON, by Connect's own client.
    const transport = createConnectTransport({ baseUrl: url, interceptors: [identify] });
    this.simulation = createClient(SimulationService, transport);
    this.joints = createClient(JointService, transport);
    this.entities = createClient(EntityService, transport);
    this.parameters = createClient(ParameterService, transport);
    this.contacts = createClient(ContactService, transport);
    this.cameras = createClient(CameraService, transport);
    this.constraints = createClient(ConstraintService, transport);
    this.recordings = createClient(RecordingService, transport);
    this.sensors = createClient(SensorService, transport);
    this.view = createClient(ViewService, transport);
  }

  /** Starts another daemon at the address of one that has ended. Another program may have that port for a moment. */
  static again(flags: string[], { url }: Daemon): Promise<Daemon> {
    return vi.waitFor(() => Daemon.start(flags, new URL(url).host), { timeout: 60_000, interval: 200 });
  }

  /** Starts a daemon with these flags, and waits until it prints its address. */
  static async start(flags: string[], listen = "127.0.0.1:0"): Promise<Daemon> {
    if (!existsSync(BINARY)) throw new Error(`there is no ${BINARY}: \`make build\` builds it`);
    const home = await mkdtemp(`${tmpdir()}/simd-e2e-`);
    const all = ["--listen", listen, ...(flags.includes("--zenoh") ? [] : ["--zenoh", "off"]), "--log", "warn", ...flags];
    const child = spawn(BINARY, all, {
      cwd: REPOSITORY,
      env: { ...process.env, HOME: home, XDG_CONFIG_HOME: home, XDG_STATE_HOME: home },
      stdio: ["ignore", "pipe", "inherit"],
    });
    const lines = createInterface({ input: child.stdout });
    const said = await Promise.race([once(lines, "line"), once(child, "exit").then(() => [])]);
    const url = /is listening on (https?:\/\/\S+)/.exec(String(said[0]))?.[1];
    if (url === undefined) {
      await rm(home, { recursive: true, force: true });
      throw new Error(`the daemon does not say where it listens, but ${said[0]}`);
    }
    return new Daemon(url, child, home);
  }

  /** The demo robot's daemon. */
  static demo(...flags: string[]): Promise<Daemon> {
    return Daemon.start(["--config", "tests/assets/demo.toml", ...flags]);
  }

  /** Shuts it down. */
  async stop(): Promise<void> {
    await this.end("SIGTERM");
  }

  /** Kills it. */
  async kill(): Promise<void> {
    await this.end("SIGKILL");
  }

  private async end(signal: NodeJS.Signals): Promise<void> {
    clearInterval(this.calls);
    if (this.child.exitCode === null && this.child.signalCode === null) {
      const gone = once(this.child, "exit");
      this.child.kill(signal);
      await gone;
    }
    await rm(this.home, { recursive: true, force: true });
  }

  /** Lets the test's client stay in the list of clients, which leaves out those without a call for five seconds. */
  stays(): void {
    this.calls ??= setInterval(() => void this.simulation.getSimulationState({}).catch(() => undefined), 500);
  }

  /** Returns world_from_link of a link: x y z and the quaternion x y z w. */
  async linkPose(robot: string, link: string): Promise<number[]> {
    const { entity } = await this.entities.getEntityInfo({ robot });
    const index = entity?.links.findIndex((one) => one.name === link) ?? -1;
    const { robots } = await this.entities.getLinkPoses({ robots: [robot] });
    const pose = robots[0]?.poses.slice(7 * index, 7 * index + 7) ?? [];
    if (index < 0 || pose.length !== 7) throw new Error(`${robot} has no link ${link}`);
    return pose;
  }

  /** Waits until this much simulated time has passed in a playing world. */
  async pass(seconds: number): Promise<void> {
    const now = async () => (await this.simulation.getSimulationState({})).stamp?.simTime ?? 0;
    for (const end = (await now()) + seconds; (await now()) < end; );
  }

  /** Sets position targets. */
  async aim(robot: string, positions: Record<string, number>): Promise<void> {
    const joints = Object.entries(positions).map(([joint, position]) => ({
      joint,
      target: { case: "position", value: { position } } as const,
    }));
    await this.joints.setJointTargets({ robots: [{ robot, joints }] });
  }

  /** Returns the present state of a joint with one axis. */
  async joint(robot: string, joint: string): Promise<{ position: number; velocity: number; target: number; mode: number }> {
    const selections = [{ robot, joints: [joint] }];
    const state = (await this.joints.getJointStates({ selections })).states?.robots[0];
    const value = (values: number[] | undefined): number => values?.[0] ?? Number.NaN;
    return {
      position: value(state?.position),
      velocity: value(state?.velocity),
      target: value(state?.target),
      mode: state?.mode[0] ?? 0,
    };
  }
}
