// Draws the scenes that tests/reference/page_pairs.py has drawn with PyBullet and MuJoCo, from the same viewpoint. Writes both side
// by side into target/pairs for people to compare: the page on the left.

import { readFile, writeFile } from "node:fs/promises";
import { resolve } from "node:path";

import { expect, test } from "vitest";

import { Base } from "../src/gen/simd/v1/entity_pb";
import { Tab } from "./browser";
import { Daemon, REPOSITORY } from "./daemon";
import { fixtures } from "./fixtures";

const use = fixtures();
const FOLDER = resolve(REPOSITORY, "target/pairs");

interface Pair {
  name: string;
  peer: string;
  path: string;
  root: string;
  position: [number, number, number];
  target: [number, number, number];
  joints: Record<string, number>;
}

const { width, height, pairs } = JSON.parse(await readFile(resolve(FOLDER, "pairs.json"), "utf8")) as { width: number; height: number; pairs: Pair[] };
/** CSS pixels of the bar above the view, and of the panels below it. */
const AROUND = 120;
const wanted = process.env.PAIR;

for (const pair of pairs.filter(({ name }) => wanted === undefined || wanted === name)) {
  test(`${pair.name} beside ${pair.peer}`, async () => {
    const daemon = await use.daemon(Daemon.start(["--paused", "--asset-root", pair.root]));
    const source = { source: { case: "path", value: pair.path } } as const;
    const { entity } = await daemon.entities.spawnEntity({ source, base: pair.path.endsWith(".urdf") ? Base.FIXED : Base.UNSPECIFIED, jointPositions: pair.joints });
    expect(entity?.name).toBeTruthy();
    // The daemon's policy allows no foreign style: the style that hides the overlays belongs to this test.
    const context = await use.context({ viewport: { width, height: height + AROUND }, colorScheme: "light", bypassCSP: true });
    await context.addInitScript(() => {
      const set = (name: string, value: unknown): void => localStorage.setItem(`simd.view.${name}`, JSON.stringify(value));
      set("quality", "high");
      set("panelOpen", false);
      set("grid", false);
    });
    const tab = await Tab.open(context, daemon.url);
    // The picture without overlays, as large as the peer's.
    await tab.page.addStyleTag({ content: `.view > :not(.viewport), .scene-labels { display: none !important; } .viewport { width: ${width}px; height: ${height}px; inset: 0 auto auto 0 !important; }` });
    await tab.page.evaluate(({ position, target }) => window.simd.camera.look(position, target), pair);
    await tab.page.waitForFunction(({ width, height }) => document.querySelector("canvas")?.clientWidth === width && document.querySelector("canvas")?.clientHeight === height, { width, height });
    await tab.page.waitForFunction(() => window.simd.settled());
    const own = (await tab.page.getByTestId("viewport").screenshot()).toString("base64");
    const other = (await readFile(resolve(FOLDER, `${pair.name}-${pair.peer}.png`))).toString("base64");
    const joined = await tab.page.evaluate(
      async (pictures) => {
        const images = await Promise.all(pictures.map((text) => createImageBitmap(new Blob([Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0))], { type: "image/png" }))));
        const canvas = new OffscreenCanvas(images.reduce((sum, image) => sum + image.width, 0), images[0]?.height ?? 1);
        let left = 0;
        for (const image of images) {
          canvas.getContext("2d")?.drawImage(image, left, 0);
          left += image.width;
        }
        const bytes = new Uint8Array(await (await canvas.convertToBlob({ type: "image/png" })).arrayBuffer());
        return btoa(bytes.reduce((text, byte) => text + String.fromCharCode(byte), ""));
      },
      [own, other],
    );
    await writeFile(resolve(FOLDER, `${pair.name}.png`), Buffer.from(joined, "base64"));
  });
}
