// A claim is renewed as long as it holds, and forgotten once the daemon no longer knows it.
import { Code, ConnectError, createRouterTransport } from "@connectrpc/connect";
import { beforeEach, expect, test, vi } from "vitest";
import { JointService, type SetJointTargetsRequest } from "../gen/simd/v1/joint_pb";
import { toasts } from "../state/toasts";
import { claim, claimedHere, release, renew } from "./claims";
import { servicesOver } from "./services";

let refusal: ConnectError | undefined;
const renewals: SetJointTargetsRequest[] = [];
const services = servicesOver(
  createRouterTransport(({ service }) => {
    service(JointService, {
      claimJoints: ({ selections }) => ({ claim: `secret of ${selections[0]?.robot ?? "the world"}` }),
      releaseJoints: () => ({}),
      setJointTargets: (request) => {
        renewals.push(request);
        if (refusal) throw refusal;
        return {};
      },
    });
  }),
);
vi.mock("./services", async (original) => ({ ...(await original<typeof import("./services")>()), services: () => services, tabName: () => "viewer-0001" }));
vi.mock("./page", () => ({ daemonConnection: () => ({ pollAllNow: () => undefined }) }));

beforeEach(async () => {
  refusal = undefined;
  await release("arm");
  renewals.length = 0;
  toasts.value = [];
  await claim("arm");
});

test("a renewal names the robot and no joint", async () => {
  await renew();
  expect(renewals.map(({ claim: secret, robots }) => [secret, robots.map(({ robot, joints }) => [robot, joints.length])])).toEqual([["secret of arm", [["arm", 0]]]]);
  expect([...claimedHere.value]).toEqual(["arm"]);
});

test("a daemon that does not answer ends no claim, and one that knows no such claim does", async () => {
  refusal = new ConnectError("it does not answer", Code.Unavailable);
  await renew();
  expect([...claimedHere.value]).toEqual(["arm"]);
  refusal = new ConnectError("this claim does not exist", Code.NotFound);
  await renew();
  expect([...claimedHere.value]).toEqual([]);
  expect(toasts.value.map(({ sentence }) => sentence).join()).toContain("arm is no longer claimed by this page");
});
