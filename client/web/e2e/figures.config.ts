// Figures for this machine, printed: `npm run figures`. Not a test: nothing here can fail for being slow.
import { defineConfig } from "vitest/config";

export default defineConfig({
  root: import.meta.dirname,
  test: { globalSetup: "./setup.ts", include: ["*.figures.ts"], fileParallelism: false, testTimeout: 1_800_000, hookTimeout: 60_000 },
});
