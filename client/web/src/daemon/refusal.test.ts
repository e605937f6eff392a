// People read the daemon's own sentence, and of a daemon that is not there that it is not.
import { Code, ConnectError } from "@connectrpc/connect";
import { expect, test } from "vitest";
import { sentenceOf } from "./refusal";

test("a refusal is told in the daemon's words", () => {
  const refusal = new ConnectError("no robot is called `arm`", Code.NotFound);
  expect(sentenceOf(refusal)).toBe("No robot is called `arm`.");
});

test("a word that begins with a name is left as it is", () => {
  expect(sentenceOf(new ConnectError("`arm/elbow` is claimed by demo.", Code.FailedPrecondition))).toBe("`arm/elbow` is claimed by demo.");
});

test("what the browser says of a failed call is that the daemon does not answer", () => {
  const failed = ConnectError.from(new TypeError("Failed to fetch"), Code.Internal);
  expect(sentenceOf(failed)).toBe("The daemon does not answer.");
  expect(sentenceOf(new TypeError("NetworkError when attempting to fetch resource."))).toBe("The daemon does not answer.");
});

test("a gateway that answers in the daemon's place is no daemon", () => {
  expect(sentenceOf(new ConnectError("HTTP 502", Code.Unavailable))).toBe("The daemon does not answer.");
});

test("an error of this page is told as it is", () => {
  expect(sentenceOf(new Error("There is no .urdf file."))).toBe("There is no .urdf file.");
});
