// Tests against a real daemon in a real browser: one file at a time, or E2E_FILES of them. On two processors two take as long, and
// some tests need their second try.
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
    // A failed test runs once more; a test that then passes is named at the end.
    retry: 1,
    reporters: ["default", new Flaky()],
    testTimeout: 300_000,
    // A browser starts slowly while other work runs.
    hookTimeout: 300_000,
    // The page fetches the clients once a second: a poll that gives up after one would fail on a busy machine. A starved one takes half a minute
    // for what takes a second.
    expect: { poll: { timeout: 120_000 } },
  },
});
