// Data that changed is fetched again, even if a request for it is already running.
import { Code, ConnectError, createRouterTransport } from "@connectrpc/connect";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { EntityService } from "../gen/simd/v1/entity_pb";
import { JointService } from "../gen/simd/v1/joint_pb";
import { scenes } from "../state/scene";
import { robots } from "../state/world";
import { RobotRegistry } from "./robot-registry";
import { servicesOver } from "./services";

const VERSIONS = new Map([["arm", 1n]]);

let holder = "";
let alive = true;
/** Promise for which an answer waits. */
let held: Promise<void> = Promise.resolve();

const services = servicesOver(
  createRouterTransport(({ service }) => {
    service(EntityService, {
      listEntities: async () => {
        if (!alive) throw new ConnectError("HTTP 502", Code.Unavailable);
        const claimedBy = holder;
        await held;
        return { entities: [...VERSIONS].map(([name, layoutVersion]) => ({ name, layoutVersion, links: [{ name: "base" }], claimedBy })) };
      },
      getScene: () => ({ robots: [...VERSIONS].map(([robot, layoutVersion]) => ({ robot, layoutVersion })) }),
    });
    service(JointService, { getJointLayout: ({ robot }) => ({ layout: { robot, layoutVersion: VERSIONS.get(robot) ?? 0n } }) });
  }),
);

const claimed = (): string | undefined => robots.value[0]?.claimedBy;
const names = new Set(["arm"]);

let registry: RobotRegistry;
beforeEach(async () => {
  vi.useFakeTimers();
  holder = "";
  alive = true;
  held = Promise.resolve();
  robots.value = [];
  scenes.value = new Map();
  registry = new RobotRegistry(services, () => undefined);
  await registry.load();
});
afterEach(() => vi.useRealTimers());

test("a claim that comes while another is fetched is fetched after it", async () => {
  let answer = (): void => undefined;
  held = new Promise((resolve) => (answer = resolve));
  const first = registry.refresh(names);
  await vi.advanceTimersByTimeAsync(10);
  holder = "lab";
  await registry.refresh(names);
  answer();
  await first;
  // The next state has the same layouts.
  await registry.update(VERSIONS);
  expect(claimed()).toBe("lab");
});

test("a claim whose fetch fails is fetched later, and not at once", async () => {
  holder = "lab";
  alive = false;
  await registry.refresh(names);
  alive = true;
  await registry.update(VERSIONS);
  expect(claimed()).toBe("");
  await vi.advanceTimersByTimeAsync(600);
  await registry.update(VERSIONS);
  expect(claimed()).toBe("lab");
});
