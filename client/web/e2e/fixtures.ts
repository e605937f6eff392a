// Fixtures: contexts of the shared browser, and daemons, that end with their test.

import type { Browser, BrowserContext, BrowserContextOptions } from "playwright-core";
import { afterAll, afterEach, beforeAll } from "vitest";

import { connect, servePage, TIMEOUT } from "./browser";
import type { Daemon } from "./daemon";

/** Creates fixtures, all of which are closed after the test. */
export interface Fixtures {
  /** A fresh profile, 1280 by 720 by default. */
  context(options?: BrowserContextOptions): Promise<BrowserContext>;
  /** Stops the daemon after the test, also if the test fails. */
  daemon(starting: Promise<Daemon>): Promise<Daemon>;
}

/** Sets fixtures up for the file that calls it. */
export function fixtures(): Fixtures {
  let browser: Browser;
  const contexts: BrowserContext[] = [];
  const daemons: Daemon[] = [];
  beforeAll(async () => {
    browser = await connect();
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
      if (!browser.isConnected()) browser = await connect();
      const context = await browser.newContext({ viewport: { width: 1280, height: 720 }, ...options });
      contexts.push(context);
      context.setDefaultTimeout(TIMEOUT);
      if (process.env.SIMD_PAGE !== undefined) await servePage(context, process.env.SIMD_PAGE);
      return context;
    },
    async daemon(starting) {
      const daemon = await starting;
      daemons.push(daemon);
      return daemon;
    },
  };
}
