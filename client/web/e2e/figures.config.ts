// Figures for this machine, printed: `npm run figures`. It is not a test: slowness cannot make it fail.
import { defineConfig } from "vitest/config";

export default defineConfig({
  root: import.meta.dirname,
  test: { globalSetup: "./setup.ts", include: ["*.figures.ts"], fileParallelism: false, testTimeout: 1_800_000, hookTimeout: 60_000 },
});
