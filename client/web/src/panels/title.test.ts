// The title shows the robot and the world, so that users find the tab.
import { expect, test } from "vitest";
import { titleOf } from "./title";

test("the title has the robot, the world and the program, each once", () => {
  expect(titleOf("arm", "lab")).toBe("arm · lab · simd");
  expect(titleOf(undefined, "lab")).toBe("lab · simd");
  expect(titleOf("arm", "simd")).toBe("arm · simd");
});

test("names of any script stay unchanged, and hidden characters are shown", () => {
  expect(titleOf("Рука机器人🤖", "")).toBe("Рука机器人🤖 · simd");
  expect(titleOf("a\u202eb", "")).toBe("a\\u{202e}b · simd");
});
