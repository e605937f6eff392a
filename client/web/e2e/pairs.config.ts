// Pictures of the page next to PyBullet's and MuJoCo's, for people to compare: `make pairs`.
import { defineConfig } from "vitest/config";

export default defineConfig({
  root: import.meta.dirname,
  test: { globalSetup: "./setup.ts", include: ["*.pairs.ts"], fileParallelism: false, testTimeout: 600_000, hookTimeout: 60_000 },
});
