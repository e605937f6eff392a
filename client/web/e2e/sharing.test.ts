// Several tabs, a restarted daemon, and the requests of the page.

import { once } from "node:events";
import { mkdtemp, rm, writeFile } from "node:fs/promises";
import { createServer } from "node:http";
import type { AddressInfo } from "node:net";
import { tmpdir } from "node:os";
import { resolve } from "node:path";

import { expect, test } from "vitest";

import { SimulationState } from "../src/gen/simd/v1/simulation_pb";
import { inSight, PICTURES, Tab } from "./browser";
import { Daemon, REPOSITORY } from "./daemon";
import { fixtures } from "./fixtures";

const use = fixtures();

test("a daemon that was killed and started again is found again, with the robots that it has then", async () => {
  const first = await use.daemon(Daemon.demo());
  const tab = await Tab.open(await use.context(), first.url);
  await first.kill();
  expect(await inSight(tab.page, "banner")).toContain("The daemon does not answer");
  await tab.picture("connection-lost");
  await use.daemon(Daemon.again(["--load", "tests/assets/Two Link.v2"], first));
  await tab.page.getByTestId("banner").waitFor({ state: "detached" });
  await tab.page.getByTestId("filter").waitFor();
  await expect.poll(() => tab.page.evaluate(() => [...(window.simd.frame()?.joints.keys() ?? [])])).not.toContain("bench_arm");
  await expect.poll(() => tab.page.getByTestId("slider").count()).toBe(2);
});

test("after a restart of the daemon the robots that the page has brought in are loaded again by a button", async () => {
  const first = await use.daemon(Daemon.start(["--gravity", "0,0,0"]));
  const tab = await Tab.open(await use.context(), first.url);
  await tab.page.getByTestId("add-demo-arm").click();
  await expect.poll(() => tab.page.getByTestId("slider").count()).toBe(5);
  await tab.page.getByTestId("folder-input").first().setInputFiles(resolve(REPOSITORY, "tests/assets/Two Link.v2"));
  await tab.page.getByTestId("load-now").click();
  await expect.poll(() => tab.page.getByTestId("slider").count()).toBe(2);
  // States may show a robot before the answer of its call, which the page remembers.
  await tab.page.getByTestId("toast").filter({ hasText: /two_link/ }).first().waitFor();
  await first.kill();
  await tab.page.getByTestId("banner").waitFor();
  const second = await use.daemon(Daemon.again(["--gravity", "0,0,0"], first));
  expect(await inSight(tab.page, "restart-note")).toMatch(/^The daemon restarted at \d\d:\d\d\. Load the last robots again\?Load 2 robots$/);
  expect(await tab.violations()).toEqual([]);
  await tab.picture("restarted");
  await tab.page.getByTestId("load-again").click();
  await tab.page.getByTestId("restart-note").waitFor({ state: "detached" });
  await expect.poll(async () => (await second.entities.listEntities({})).entities.map(({ name }) => name)).toEqual(["demo_arm", "two_link"]);
  await expect.poll(() => tab.page.getByTestId("slider").count()).toBe(2);
});

test("seven tabs of one browser are all live, playing and paused", async () => {
  const daemon = await use.daemon(Daemon.demo());
  const context = await use.context();
  const tabs = await Promise.all(Array.from({ length: 7 }, () => Tab.open(context, daemon.url)));
  const steps = () => Promise.all(tabs.map((tab) => tab.page.evaluate(() => Number(window.simd.frame()?.step ?? 0n))));
  const before = await steps();
  for (const [i, tab] of tabs.entries()) {
    await tab.page.waitForFunction((least) => (window.simd.frame()?.step ?? 0n) > BigInt(least + 100), before[i] ?? 0);
  }
  await daemon.simulation.setSimulationState({ state: SimulationState.PAUSED });
  await daemon.aim("bench_arm", { shoulder: 0.9 });
  for (const tab of tabs) {
    await tab.page.waitForFunction(() => Math.abs((window.simd.frame()?.joints.get("bench_arm")?.target[0] ?? 0) - 0.9) < 1e-9);
  }
  await expect.poll(() => tabs.at(-1)?.page.getByTestId("clients").textContent()).toMatch(/^\D*[78]/);
});

test("a robot and the world are claimed by a button: other pages say by whom, and may change them once they are released", async () => {
  const daemon = await use.daemon(Daemon.demo());
  const context = await use.context();
  const [own, other] = await Promise.all([Tab.open(context, daemon.url), Tab.open(context, daemon.url)]);
  const name = (await own.page.evaluate(() => sessionStorage.getItem("simd.client"))) ?? "";
  const titleOf = (tab: Tab, id: string) => tab.page.getByTestId(id).first().getAttribute("title");
  await own.page.getByTestId("claim-robot").click();
  await expect.poll(() => own.page.getByTestId("claim-robot").getAttribute("aria-pressed")).toBe("true");
  for (const id of ["slider", "number", "mode", "hold-all", "remove", "play", "reset"]) {
    await expect.poll(() => other.page.getByTestId(id).first().isDisabled(), { message: id }).toBe(true);
    expect(await titleOf(other, id)).toContain(`${name} has claimed`);
  }
  expect(await other.violations()).toEqual([]);
  await other.picture("claimed-by-another");
  // The client with the claim moves it, even after a reload.
  await own.page.reload();
  await own.page.waitForFunction(() => window.simd?.frame() != null && window.simd.settled());
  const number = own.page.getByTestId("number").first();
  await number.fill("0.4");
  await number.press("Enter");
  await expect.poll(async () => (await daemon.joint("bench_arm", "shoulder")).target).toBeCloseTo(0.4, 9);
  await own.page.getByTestId("play").click();
  await expect.poll(async () => (await daemon.simulation.getSimulationState({})).state).toBe(SimulationState.PAUSED);
  await own.picture("claimed");
  await own.page.getByTestId("claim-robot").click();
  await expect.poll(() => other.page.getByTestId("slider").first().isEnabled()).toBe(true);
  await own.page.getByTestId("claim-world").click();
  await expect.poll(() => other.page.getByTestId("step").isDisabled()).toBe(true);
  expect(await titleOf(other, "step")).toContain(`${name} has claimed the world`);
  await own.page.getByTestId("play").click();
  await expect.poll(async () => (await daemon.simulation.getSimulationState({})).state).toBe(SimulationState.PLAYING);
  await own.page.getByTestId("claim-world").click();
  await expect.poll(() => other.page.getByTestId("step").isEnabled()).toBe(true);
  expect(own.consoleMessages).toEqual([]);
});

test("a page asks no other host anything, and its policy says so", async () => {
  const daemon = await use.daemon(Daemon.demo());
  const tab = await Tab.open(await use.context(), daemon.url);
  await tab.page.keyboard.press("p");
  await tab.page.keyboard.press("?");
  const hosts = new Set(tab.requests.filter((url) => url.protocol.startsWith("http")).map((url) => url.origin));
  expect([...hosts]).toEqual([new URL(daemon.url).origin]);
  const answer = await fetch(daemon.url);
  const policy = answer.headers.get("content-security-policy") ?? "";
  expect(policy).toContain("default-src 'self'");
  expect(policy).not.toContain("unsafe");
  expect(policy).not.toMatch(/https?:|\*/);
  // The console would show violations of the policy.
  expect(tab.consoleMessages).toEqual([]);
});

test("a site that the operator named has the page in a frame, and another has not", async () => {
  let address = "";
  const site = createServer((_, answer) => answer.setHeader("content-type", "text/html").end(`<iframe src="${address}" style="width: 900px; height: 600px"></iframe>`));
  site.listen(0, "127.0.0.1");
  await once(site, "listening");
  const { port } = site.address() as AddressInfo;
  const folder = await mkdtemp(`${tmpdir()}/simd-frame-`);
  try {
    const config = resolve(folder, "simd.toml");
    await writeFile(config, `frame_ancestors = ["http://127.0.0.1:${port}"]\n[[robots]]\npath = "${resolve(REPOSITORY, "tests/assets/Two Link.v2")}"\nfixed = true\n`);
    const daemon = await use.daemon(Daemon.start(["--config", config]));
    address = daemon.url;
    const page = await (await use.context()).newPage();
    await page.goto(`http://127.0.0.1:${port}/notebook`);
    await page.frameLocator("iframe").getByTestId("slider").first().waitFor();
    await page.frameLocator("iframe").getByTestId("viewport").waitFor();
    await page.screenshot({ path: resolve(PICTURES, "framed.png") });
    // Under another name it is another site.
    await page.goto(`http://localhost:${port}/notebook`);
    await expect.poll(() => page.frames().at(-1)?.url()).toMatch(/^chrome-error:/);
  } finally {
    site.close();
    await rm(folder, { recursive: true });
  }
});
