// Tests against a real daemon in a real browser: two files at a time, since a test mostly waits.
import { defineConfig } from "vitest/config";

import { Flaky } from "./flaky.ts";

export default defineConfig({
  root: import.meta.dirname,
  test: {
    include: ["*.test.ts"],
    globalSetup: "./setup.ts",
    maxWorkers: 2,
    // A test that fails runs once more; one that passes then is named at the end.
    retry: 1,
    reporters: ["default", new Flaky()],
    testTimeout: 300_000,
    hookTimeout: 60_000,
    // The page asks who is here once a second: a poll that gives up after one would fail on a busy machine.
    expect: { poll: { timeout: 60_000 } },
  },
});
