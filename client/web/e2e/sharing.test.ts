// Several tabs, a daemon that goes and comes back, and what the page asks of whom.

import type { Browser, BrowserContext } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";

import { launch, Tab } from "./browser";
import { Daemon } from "./daemon";

let browser: Browser;
beforeAll(async () => {
  browser = await launch();
});
afterAll(async () => {
  await browser.close();
});

async function withTabs(work: (context: BrowserContext) => Promise<void>): Promise<void> {
  const context = await browser.newContext({ viewport: { width: 1280, height: 720 } });
  try {
    await work(context);
  } finally {
    await context.close();
  }
}

test("a daemon that was killed and started again is found again, with the robots that it has then", async () => {
  await withTabs(async (context) => {
    const first = await Daemon.demo();
    const tab = await Tab.open(context, first.url);
    await first.kill();
    await tab.page.getByTestId("banner").waitFor({ state: "visible" });
    expect(await tab.page.getByTestId("banner").textContent()).toMatch(/\d/);
    await tab.picture("connection-lost");
    const second = await Daemon.start(["--load", "tests/assets/Two Link.v2"], new URL(first.url).host);
    try {
      await tab.page.getByTestId("banner").waitFor({ state: "detached" });
      await tab.page.getByTestId("filter").waitFor();
      await expect.poll(() => tab.page.evaluate(() => [...(window.simd.frame()?.joints.keys() ?? [])])).not.toContain("bench_arm");
      await expect.poll(() => tab.page.getByTestId("slider").count()).toBe(2);
    } finally {
      await second.stop();
    }
  });
});

test("seven tabs of one browser are all live, playing and paused", async () => {
  await withTabs(async (context) => {
    const daemon = await Daemon.demo();
    try {
      const tabs: Tab[] = [];
      for (let i = 0; i < 7; i += 1) tabs.push(await Tab.open(context, daemon.url));
      const steps = () => Promise.all(tabs.map((tab) => tab.page.evaluate(() => Number(window.simd.frame()?.step ?? 0n))));
      const before = await steps();
      for (const [i, tab] of tabs.entries()) {
        await tab.page.waitForFunction((least) => (window.simd.frame()?.step ?? 0n) > BigInt(least + 100), before[i] ?? 0);
      }
      await daemon.simulation.setSimulationState({ state: 3 });
      await daemon.joints.setJointTargets({
        robots: [{ robot: "bench_arm", joints: [{ joint: "shoulder", target: { case: "position", value: { position: 0.9 } } }] }],
      });
      for (const tab of tabs) {
        await tab.page.waitForFunction(() => Math.abs((window.simd.frame()?.joints.get("bench_arm")?.target[0] ?? 0) - 0.9) < 1e-9);
      }
      const last = tabs.at(-1);
      await expect.poll(() => last?.page.getByTestId("clients").textContent()).toMatch(/^\D*[78]/);
    } finally {
      await daemon.stop();
    }
  });
});

test("a page asks no other host anything, and its policy says so", async () => {
  await withTabs(async (context) => {
    const daemon = await Daemon.demo();
    try {
      const tab = await Tab.open(context, daemon.url);
      await tab.page.keyboard.press("p");
      await tab.page.keyboard.press("?");
      const hosts = new Set(tab.requests.filter((url) => url.protocol.startsWith("http")).map((url) => url.origin));
      expect([...hosts]).toEqual([new URL(daemon.url).origin]);
      const answer = await fetch(daemon.url);
      const policy = answer.headers.get("content-security-policy") ?? "";
      expect(policy).toContain("default-src 'self'");
      expect(policy).not.toContain("unsafe");
      expect(policy).not.toMatch(/https?:|\*/);
      // What the policy forbids would be complained about.
      expect(tab.complaints).toEqual([]);
    } finally {
      await daemon.stop();
    }
  });
});
