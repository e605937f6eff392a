// Starts the browser that all tests of a run share.

import { existsSync } from "node:fs";

import { type BrowserServer, chromium } from "playwright-core";
import type { TestProject } from "vitest/node";

declare module "vitest" {
  interface ProvidedContext {
    /** Where the browser of the run is reached. */
    browser: string;
  }
}

const EXECUTABLES = [process.env.CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];

/** Starts a browser that connects to no other host by itself. */
async function launch(): Promise<BrowserServer> {
  const executablePath = EXECUTABLES.find((path) => path !== undefined && existsSync(path));
  if (executablePath === undefined) throw new Error("there is no Chromium: `apt-get install chromium`, or name one in CHROMIUM");
  const args = [
    "--no-sandbox",
    "--enable-unsafe-swiftshader",
    "--use-angle=swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-quic",
    "--no-first-run",
  ];
  return chromium.launchServer({ executablePath, args, headless: true });
}

export default async function setup(project: TestProject): Promise<() => Promise<void>> {
  const browser = await launch();
  project.provide("browser", browser.wsEndpoint());
  return () => browser.close();
}
