// People read the daemon's sentence. If no daemon answers, they read that.
import { Code, ConnectError } from "@connectrpc/connect";
import { expect, test } from "vitest";
import { messageOf } from "./error-message";

test("an error of the daemon keeps its message", () => {
  const refusal = new ConnectError("no robot is called `arm`", Code.NotFound);
  expect(messageOf(refusal)).toBe("No robot is called `arm`.");
});

test("a message that begins with a name is not capitalised", () => {
  expect(messageOf(new ConnectError("`arm/elbow` is claimed by demo.", Code.FailedPrecondition))).toBe("`arm/elbow` is claimed by demo.");
});

test("what a role forbids is said without the method that was called", () => {
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
