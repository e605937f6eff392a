// What each file of tests stands on: one browser, and for each test contexts and daemons that end with it.

import type { Browser, BrowserContext, BrowserContextOptions } from "playwright-core";
import { afterAll, afterEach, beforeAll } from "vitest";

import { launch } from "./browser";
import type { Daemon } from "./daemon";

/** What tests take from; all of it is cleared away after each. */
export interface Stand {
  /** As a browser that was just started, 1280 by 720 where nothing else is said. */
  context(options?: BrowserContextOptions): Promise<BrowserContext>;
  /** Ends the daemon with the test, however that ends. */
  daemon(starting: Promise<Daemon>): Promise<Daemon>;
}

/** Sets it up for the file that calls it. */
export function stand(): Stand {
  let browser: Browser;
  const contexts: BrowserContext[] = [];
  const daemons: Daemon[] = [];
  beforeAll(async () => {
    browser = await launch();
  });
  afterAll(async () => {
    await browser.close();
  });
  afterEach(async () => {
    for (const context of contexts.splice(0)) await context.close();
    for (const daemon of daemons.splice(0)) await daemon.stop();
  });
  return {
    async context(options = {}) {
      const context = await browser.newContext({ viewport: { width: 1280, height: 720 }, ...options });
      contexts.push(context);
      return context;
    },
    async daemon(starting) {
      const daemon = await starting;
      daemons.push(daemon);
      return daemon;
    },
  };
}
