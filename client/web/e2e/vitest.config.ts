// Tests against a real daemon in a real browser; one after the other, since both cores are busy with each.
import { defineConfig } from "vitest/config";

export default defineConfig({
  root: import.meta.dirname,
  test: {
    include: ["*.test.ts"],
    fileParallelism: false,
    testTimeout: 300_000,
    hookTimeout: 60_000,
    // The page asks who is here once a second: a poll that gives up after one would fail on a busy machine.
    expect: { poll: { timeout: 60_000 } },
  },
});
