// Tests against a real daemon in a real browser: one file at a time, or as many as E2E_FILES says. On two processors two take as long,
// and some tests need their second try.
import { defineConfig } from "vitest/config";

import { Flaky } from "./flaky.ts";

export default defineConfig({
  root: import.meta.dirname,
  test: {
    include: ["*.test.ts"],
    globalSetup: "./setup.ts",
    // One process for all files: modules are loaded once.
    isolate: false,
    maxWorkers: Number(process.env["E2E_FILES"] ?? 1),
    // A test that fails runs once more; one that passes then is named at the end.
    retry: 1,
    reporters: ["default", new Flaky()],
    testTimeout: 300_000,
    hookTimeout: 60_000,
    // The page asks who is here once a second: a poll that gives up after one would fail on a busy machine.
    expect: { poll: { timeout: 60_000 } },
  },
});
