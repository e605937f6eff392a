// Build of the page, and its development server.
import { defineConfig } from "vitest/config";
import { compress } from "./compress.ts";

/** The daemon that `npm run dev` shows. */
const daemon = process.env["SIMD_URL"] ?? "http://127.0.0.1:7400";

/** The daemon answers only pages that it has served itself, as far as it can see. */
const proxied = { target: daemon, changeOrigin: true, headers: { origin: daemon } };

export default defineConfig({
  plugins: [compress()],
  build: {
    target: "es2023",
    modulePreload: { polyfill: false },
    // Data addresses would need a wider content security policy.
    assetsInlineLimit: 0,
    // One file: three is most of it, and needed at once.
    chunkSizeWarningLimit: 1200,
    // The first view needs one file: parts that others share would be compressed apart.
    rolldownOptions: { output: { codeSplitting: { groups: [{ name: "first", tags: ["$initial"] }] } } },
  },
  // Tests that need a daemon and a browser are in e2e, with a separate configuration.
  test: { include: ["src/**/*.test.ts"] },
  server: {
    proxy: {
      "/simd.v1.": proxied,
      "/meshes": proxied,
      "/colliders": proxied,
    },
  },
});
