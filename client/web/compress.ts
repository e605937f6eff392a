// Puts a gzipped copy next to each text file of the bundle, so that the daemon need not compress.
import { readdir, readFile, writeFile } from "node:fs/promises";
import { join, resolve } from "node:path";
import { gzipSync } from "node:zlib";
import type { Plugin } from "vite";

const TEXT = /\.(html|js|css|svg|json|txt)$/;

/** A plugin of Vite that compresses the built files, and prints their sizes. */
export function compress(): Plugin {
  let folder = "dist";
  return {
    name: "compress",
    apply: "build",
    configResolved(config) {
      folder = resolve(config.root, config.build.outDir);
    },
    async closeBundle() {
      let total = 0;
      let first = 0;
      const index = await readFile(join(folder, "index.html"), "utf8");
      for (const entry of await readdir(folder, { recursive: true, withFileTypes: true })) {
        if (!entry.isFile() || !TEXT.test(entry.name)) continue;
        const path = join(entry.parentPath, entry.name);
        const packed = gzipSync(await readFile(path), { level: 9 });
        await writeFile(`${path}.gz`, packed);
        total += packed.length;
        // The first view needs the files that the page names; the rest is loaded on demand.
        if (entry.name === "index.html" || index.includes(`/${entry.name}"`)) first += packed.length;
      }
      console.log(`bundle: ${(first / 1000).toFixed(1)} kB gzipped for the first view, ${(total / 1000).toFixed(1)} kB in all`);
    },
  };
}
