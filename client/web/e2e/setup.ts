// Starts the browser that all tests of a run share.

import { existsSync } from "node:fs";
import { rm } from "node:fs/promises";
import { resolve } from "node:path";

import { type BrowserServer, chromium } from "playwright-core";
import type { TestProject } from "vitest/node";

import { REPOSITORY } from "./daemon";

/** The folder of files that tests download, emptied by each run. */
export const DOWNLOADS = resolve(REPOSITORY, "target/downloads");

declare module "vitest" {
  interface ProvidedContext {
    /** Address of the run's browser. */
    browser: string;
  }
}

const EXECUTABLES = [process.env.CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];

/**
 * Starts a browser that connects only to hosts that a page names, on an address that was chosen before, or else on a free
 * one.
 */
async function launch(address: { port?: number; wsPath?: string } = {}): Promise<BrowserServer> {
  const executablePath = EXECUTABLES.find((path) => path !== undefined && existsSync(path));
  if (executablePath === undefined) throw new Error("there is no Chromium: `apt-get install chromium`, or name one in CHROMIUM");
  const args = [
    "--no-sandbox",
    "--enable-unsafe-swiftshader",
    "--use-angle=swiftshader",
    // The processor draws the page around the picture faster than SwiftShader, which takes four times as long for an empty
    // world.
    "--disable-gpu-compositing",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-quic",
    "--no-first-run",
  ];
  return chromium.launchServer({ executablePath, args, headless: true, host: "127.0.0.1", ...address });
}

export default async function setup(project: TestProject): Promise<() => Promise<void>> {
  await rm(DOWNLOADS, { recursive: true, force: true });
  let isOver = false;
  let browser = await launch();
  const { port, pathname } = new URL(browser.wsEndpoint());
  // A browser that ends fails only the tests that use it, and not later ones.
  const startAgain = async (): Promise<void> => {
    if (isOver) return;
    console.error("the browser of the tests ended; another one is started");
    browser = await launch({ port: Number(port), wsPath: pathname });
    browser.on("close", startAgain);
  };
  browser.on("close", startAgain);
  project.provide("browser", browser.wsEndpoint());
  return () => {
    isOver = true;
    return browser.close();
  };
}
