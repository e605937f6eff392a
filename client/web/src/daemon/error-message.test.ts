// People read the daemon's sentence. If no daemon answers, they read that.
import { Code, ConnectError, createRouterTransport } from "@connectrpc/connect";
import { expect, test } from "vitest";
import { SimulationService } from "../gen/simd/v1/simulation_pb";
import { isTimeout, messageOf } from "./error-message";
import { servicesOver } from "./services";

test("an error of the daemon keeps its message", () => {
  const refusal = new ConnectError("no robot is called `arm`", Code.NotFound);
  expect(messageOf(refusal)).toBe("No robot is called `arm`.");
});

test("a message that begins with a name is not capitalised", () => {
  expect(messageOf(new ConnectError("`arm/elbow` is claimed by demo.", Code.FailedPrecondition))).toBe("`arm/elbow` is claimed by demo.");
});

test("a refusal because of a role does not name the called method", () => {
  const refusal = new ConnectError("the token of anna has the role viewer, and SetJointTargets needs the role operator", Code.PermissionDenied);
  expect(messageOf(refusal)).toBe("Your token has the role viewer, and this needs the role operator.");
});

test("a failed fetch means that the daemon does not answer", () => {
  const failed = ConnectError.from(new TypeError("Failed to fetch"), Code.Internal);
  expect(messageOf(failed)).toBe("The daemon does not answer.");
  expect(messageOf(new TypeError("NetworkError when attempting to fetch resource."))).toBe("The daemon does not answer.");
});

test("the answer of a proxy means that the daemon does not answer", () => {
  expect(messageOf(new ConnectError("HTTP 502", Code.Unavailable))).toBe("The daemon does not answer.");
});

test("an error of the page keeps its message", () => {
  expect(messageOf(new Error("There is no .urdf file."))).toBe("There is no .urdf file.");
});

test("a call that the page gave up says so, and a deadline of the daemon keeps its message", async () => {
  const services = servicesOver(createRouterTransport(({ service }) => service(SimulationService, { getSimulatorInfo: () => new Promise(() => undefined) })));
  const error: unknown = await services.simulation.getSimulatorInfo({}, { timeoutMs: 1 }).catch((reason: unknown) => reason);
  expect(isTimeout(error)).toBe(true);
  expect(messageOf(error)).toBe("The daemon did not answer in time.");
  const own = new ConnectError("no renderer drew the picture within 2 s", Code.DeadlineExceeded);
  expect([isTimeout(own), messageOf(own)]).toEqual([false, "No renderer drew the picture within 2 s."]);
});
