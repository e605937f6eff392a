// A machine that draws slowly draws less during motion, and everything once nothing moves.
import { Camera, Mesh, PlaneGeometry, Scene, type WebGLRenderer } from "three";
import { beforeEach, expect, test, vi } from "vitest";
import { Appearance } from "./appearance";
import type { Grid } from "./grid";
import type { Light } from "./light";
import { Surface } from "./surface";
import type { ViewCamera } from "./view-camera";

vi.stubGlobal("devicePixelRatio", 1);

/** Pixels of the page per pixel of the picture, and whether the grid consists of lines, as last set. */
let ratio = 1;
let isCheap = false;
let appearance: Appearance;
const ground = new Mesh(new PlaneGeometry(), new Surface());

beforeEach(() => {
  ratio = 1;
  const context = { RENDERER: 1, getParameter: () => "ANGLE (Google, Vulkan 1.3.0 (SwiftShader Device))", getExtension: () => null };
  const renderer = { getContext: () => context, getPixelRatio: () => ratio, setPixelRatio: (next: number) => (ratio = next) } as unknown as WebGLRenderer;
  const light = { refine: () => undefined } as unknown as Light;
  const grid = { simplify: (cheap: boolean) => (isCheap = cheap) } as unknown as Grid;
  appearance = new Appearance(renderer, new Scene().add(ground), light, grid, new Camera() as ViewCamera, () => undefined);
  appearance.choose("auto");
});

/** Takes thirty pictures in a row, this many milliseconds apart. */
function draw(interval: number): void {
  for (let picture = 0; picture < 30; picture += 1) appearance.measure(picture * interval, true, true);
}

test("if the processor draws, light is computed at corners and the grid is made of lines", () => {
  expect([appearance.quality, isCheap, ground.material.customProgramCacheKey()]).toEqual(["low", true, "corners"]);
  const { version } = ground.material;
  appearance.choose("high");
  expect([appearance.quality, isCheap, ground.material.customProgramCacheKey()]).toEqual(["high", false, "pixels"]);
  expect(ground.material.version).toBeGreaterThan(version);
});

test("pictures that come fast enough have all of their pixels, also while something moves", () => {
  draw(20);
  expect([appearance.setPixels(true), ratio]).toEqual([false, 1]);
});

test("pictures that come too slowly have half of them while something moves, and all when nothing does", () => {
  draw(60);
  expect([appearance.setPixels(true), ratio]).toEqual([true, 0.5]);
  expect([appearance.setPixels(false), ratio]).toEqual([false, 1]);
});

test("the chosen high quality stays, however slow it is", () => {
  appearance.choose("high");
  draw(60);
  expect([appearance.setPixels(true), ratio]).toEqual([false, 1]);
});
