// Headless Chromium with a software renderer, and helpers for its pages.

import { randomUUID } from "node:crypto";
import { existsSync } from "node:fs";
import { mkdir, readFile, writeFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { resolve } from "node:path";

import { type Browser, type BrowserContext, chromium, type Download, type Page } from "playwright-core";
import { expect, inject, vi } from "vitest";

import { type Daemon, REPOSITORY } from "./daemon";
import { DOWNLOADS } from "./setup";

/** Milliseconds after which an operation has failed, far more than a software renderer needs. */
export const TIMEOUT = 120_000;

/** The folder of screenshots, which git ignores. */
export const PICTURES = resolve(REPOSITORY, "target/screenshots");

/** Joins the browser that `setup.ts` started for the run. Closing it ends this connection and its contexts, not the browser. */
export async function connect(): Promise<Browser> {
  // Chromium may have ended: it is started again, which takes a moment.
  return vi.waitFor(() => chromium.connect(inject("browser")), { timeout: TIMEOUT, interval: 200 });
}

/** Warning of WebGL in a browser that draws the page in software, and so reads the picture back. */
const READS_BACK = /GL Driver Message .*GPU stall due to ReadPixels/;

const TYPES: Record<string, string> = { html: "text/html", js: "text/javascript", css: "text/css", svg: "image/svg+xml" };

/** Serves the page from a folder in place of the daemon's page, under the daemon's policy. */
export async function servePage(context: BrowserContext, folder: string): Promise<void> {
  await context.route(/^https?:\/\/[^/]+\/(?:|[\w.-]+\.(?:html|js|css|svg)|assets\/[\w.-]+)$/, async (route) => {
    const path = new URL(route.request().url()).pathname.slice(1) || "index.html";
    // The daemon serves files of robots.
    if (!existsSync(resolve(folder, path))) return route.fallback();
    const headers: Record<string, string> = { ...(await context.request.get(new URL("/", route.request().url()).href)).headers(), "content-type": TYPES[path.split(".").at(-1) ?? ""] ?? "" };
    for (const name of ["content-encoding", "content-length", "etag"]) delete headers[name];
    await route.fulfill({ headers, body: await readFile(resolve(folder, path)) });
  });
}

/** A page of a daemon, with its requests and the errors and warnings of its console. */
export class Tab {
  readonly requests: URL[] = [];
  readonly consoleMessages: string[] = [];

  private constructor(readonly page: Page) {
    page.setDefaultTimeout(TIMEOUT);
    page.on("request", (request) => this.requests.push(new URL(request.url())));
    page.on("console", (message) => {
      const isOurs = !READS_BACK.test(message.text());
      if (isOurs && (message.type() === "error" || message.type() === "warning")) this.consoleMessages.push(message.text());
    });
    page.on("pageerror", (error) => this.consoleMessages.push(String(error)));
  }

  /** Opens a page and waits until its program runs. */
  static async load(context: BrowserContext, url: string): Promise<Tab> {
    const tab = new Tab(await context.newPage());
    await tab.page.goto(url);
    await tab.page.waitForFunction(() => window.simd !== undefined);
    return tab;
  }

  /** Opens a page and waits until it is drawn. */
  static async open(context: BrowserContext, url: string): Promise<Tab> {
    const tab = await Tab.load(context, url);
    await tab.page.waitForFunction(() => window.simd?.frame() != null && window.simd.settled());
    return tab;
  }

  /** Returns the position of a point of the world on the page, in CSS pixels. */
  project(point: number[]): Promise<{ x: number; y: number }> {
    return this.page.evaluate((at) => window.simd.project(at as [number, number, number]), point);
  }

  /** Waits until the page has drawn a state of at least this sequence. */
  async caughtUp(sequence: bigint): Promise<void> {
    await this.page.waitForFunction((least) => window.simd.drawn() >= BigInt(least), sequence.toString());
  }

  /** Waits until the page has drawn the daemon's present state, and nothing is pending. */
  async shows(daemon: Daemon): Promise<void> {
    const { states } = await daemon.joints.getJointStates({});
    await this.caughtUp(states?.stamp?.sequence ?? 0n);
    await this.page.waitForFunction(() => window.simd.settled());
  }

  /** Moves the pointer onto a handle, and waits until the page reports it. */
  async onHandle({ x, y }: { x: number; y: number }): Promise<void> {
    const isThere = async (): Promise<boolean> => {
      await this.page.mouse.move(x - 1, y);
      await this.page.mouse.move(x, y);
      return this.page.evaluate(() => window.simd.handle());
    };
    await expect.poll(isThere).toBe(true);
  }

  /** Waits until the page reports another client, this test's, which stays from now on. */
  async seesAnother(daemon: Daemon): Promise<void> {
    daemon.stays();
    await expect.poll(() => this.page.getByTestId("clients").textContent()).toMatch(/^([2-9]|[1-9]\d+) connected/);
  }

  /** Returns the bounding box and the number of pixels of a range of hues, in degrees from red to yellow, within an area. */
  async seen(area: Bounds, from: number, to: number): Promise<{ box: Bounds; pixels: number }> {
    const png = (await this.screenshot()).toString("base64");
    return this.page.evaluate(
      async ({ png, area, from, to }) => {
        const bytes = Uint8Array.from(atob(png), (letter) => letter.charCodeAt(0));
        const image = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
        const drawing = new OffscreenCanvas(image.width, image.height).getContext("2d");
        if (drawing === null) throw new Error("no canvas");
        drawing.drawImage(image, 0, 0);
        const { data } = drawing.getImageData(0, 0, image.width, image.height);
        const box = { left: Infinity, right: -Infinity, top: Infinity, bottom: -Infinity };
        let pixels = 0;
        for (let y = Math.max(0, Math.ceil(area.top)); y < Math.min(image.height, area.bottom); y += 1) {
          for (let x = Math.max(0, Math.ceil(area.left)); x < Math.min(image.width, area.right); x += 1) {
            const [red = 0, green = 0, blue = 0] = data.subarray(4 * (y * image.width + x));
            const grey = Math.min(green, blue);
            if (red < 40 || red < green || (red - grey) / red < 0.5) continue;
            const hue = (60 * (green - blue)) / (red - grey);
            if (hue < from || hue > to) continue;
            pixels += 1;
            box.left = Math.min(box.left, x);
            box.right = Math.max(box.right, x + 1);
            box.top = Math.min(box.top, y);
            box.bottom = Math.max(box.bottom, y + 1);
          }
        }
        return { box, pixels };
      },
      { png, area, from, to },
    );
  }

  /**
   * Returns the accessibility faults that axe finds: the rule and the first element of each. Without `rules`, all rules are checked.
   */
  async violations(rules: readonly string[] = []): Promise<string[]> {
    if (!(await this.page.evaluate(() => "axe" in window))) await this.page.evaluate(await readFile(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8"));
    return this.page.evaluate(async (only) => {
      const { axe } = window as unknown as { axe: { run(options: object): Promise<{ violations: { id: string; help: string; nodes: { html: string }[] }[] }> } };
      const { violations } = await axe.run(only.length > 0 ? { runOnly: { type: "rule", values: only } } : {});
      return violations.map(({ id, help, nodes }) => `${id}: ${help}: ${nodes[0]?.html}`);
    }, rules);
  }

  /** Returns a PNG of the page with all its drawings: the browser shows a drawing one or two frames later. */
  async screenshot(): Promise<Buffer> {
    await this.page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
    return this.page.screenshot();
  }

  /** Saves a screenshot. */
  async picture(name: string): Promise<void> {
    await mkdir(PICTURES, { recursive: true });
    await writeFile(resolve(PICTURES, `${name}.png`), await this.screenshot());
  }
}

/** Saves a download below `target`, and returns its path. */
export async function savedFile(download: Download): Promise<string> {
  const path = resolve(DOWNLOADS, randomUUID(), download.suggestedFilename());
  await download.saveAs(path);
  return path;
}

/** Runs in the page. Returns how many of these elements are visible at their middle, and their number. */
export function seenAtMiddle(selector: string): { seen: number; all: number } {
  const all = [...document.querySelectorAll<HTMLElement>(selector)];
  const hit = all.filter((element) => {
    const { left, top, width, height } = element.getBoundingClientRect();
    const found = document.elementFromPoint(left + width / 2, top + height / 2);
    return found !== null && (element.contains(found) || found.contains(element));
  });
  return { seen: hit.length, all: all.length };
}

/** Runs in the page. Returns the text that the user sees in the middle of the picture. */
export function inTheMiddle(): string {
  const box = document.querySelector("[data-testid=viewport]")?.getBoundingClientRect();
  return (box && document.elementFromPoint(box.left + box.width / 2, box.top + 0.44 * box.height)?.textContent) ?? "";
}

/** Waits until users see an element: nothing covers its middle, which is in the window. Returns its text. */
export async function inSight(page: Page, testId: string): Promise<string> {
  await expect.poll(() => page.evaluate(seenAtMiddle, `[data-testid="${testId}"]`), { message: testId }).toEqual({ seen: 1, all: 1 });
  return (await page.getByTestId(testId).textContent()) ?? "";
}

/** Runs in the page. Returns the number of coloured pixels of a plot: its lines are coloured, its grid and letters are grey. */
export function colouredPixels(): number {
  const canvas = document.querySelector<HTMLCanvasElement>("[data-testid=plot] canvas");
  const data = canvas?.getContext("2d")?.getImageData(0, 0, canvas.width, canvas.height).data ?? [];
  let count = 0;
  for (let at = 0; at < data.length; at += 4) {
    const parts = [data[at] ?? 0, data[at + 1] ?? 0, data[at + 2] ?? 0];
    if ((data[at + 3] ?? 0) > 100 && Math.max(...parts) - Math.min(...parts) > 60) count += 1;
  }
  return count;
}

/** Runs in the page. Returns the spread of the middles of the top bar's parts, as a share of its height, and the pixels beyond its width. */
export function rowOfBar(): { spread: number; over: number } {
  const bar = document.querySelector(".top-bar");
  const middles = [...(bar?.children ?? [])].map((child) => child.getBoundingClientRect()).filter(({ width }) => width > 0).map(({ top, height }) => top + height / 2);
  return { spread: (Math.max(...middles) - Math.min(...middles)) / (bar?.clientHeight ?? NaN), over: (bar?.scrollWidth ?? NaN) - (bar?.clientWidth ?? NaN) };
}

/** Smallest box around points or pixels. */
export interface Bounds {
  left: number;
  right: number;
  top: number;
  bottom: number;
}

export function bounds(points: Iterable<{ x: number; y: number }>): Bounds {
  const box = { left: Infinity, right: -Infinity, top: Infinity, bottom: -Infinity };
  for (const { x, y } of points) {
    box.left = Math.min(box.left, x);
    box.right = Math.max(box.right, x);
    box.top = Math.min(box.top, y);
    box.bottom = Math.max(box.bottom, y);
  }
  return box;
}
