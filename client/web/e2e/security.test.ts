// A daemon that requires tokens, over TLS with a private authority.

import { execFileSync } from "node:child_process";
import { createHash } from "node:crypto";
import { chmodSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";

import { afterAll, expect, test } from "vitest";

import { inSight, Tab } from "./browser";
import { BINARY, Daemon } from "./daemon";
import { fixtures } from "./fixtures";

const use = fixtures();

const VIEWER = `simd_${"1".repeat(64)}`;

let folder = "";
afterAll(() => rmSync(folder, { recursive: true, force: true }));

/** Flags of TLS and of tokens, with files in a folder that ends with the test. */
function files(): string[] {
  folder = mkdtempSync(`${tmpdir()}/simd-tls-`);
  execFileSync(BINARY, ["tls", "init", folder]);
  const hash = createHash("sha256").update(VIEWER).digest("hex");
  writeFileSync(`${folder}/tokens`, `anna viewer ${hash} never\n`);
  chmodSync(`${folder}/tokens`, 0o600);
  return ["--tls-certificate", `${folder}/server.pem`, "--tls-key", `${folder}/server.key`, "--tokens", `${folder}/tokens`];
}

test("a page asks for a token, keeps it out of reach of scripts, and shows what the token allows", async () => {
  const daemon = await use.daemon(Daemon.demo(...files()));
  expect(daemon.url).toMatch(/^https:/);
  const context = await use.context({ ignoreHTTPSErrors: true });
  const page = await context.newPage();
  await page.goto(daemon.url);
  const card = page.getByTestId("log-in");
  await card.waitFor();
  await page.getByTestId("token").fill("simd_wrong");
  await card.getByRole("button").click();
  expect(await inSight(page, "refusal")).toContain("unknown, or was revoked");
  await page.screenshot({ path: `${import.meta.dirname}/../../../target/screenshots/log-in.png` });
  await page.getByTestId("token").fill(VIEWER);
  await card.getByRole("button").click();
  await card.waitFor({ state: "detached" });
  await page.waitForFunction(() => window.simd?.frame()?.joints.has("bench_arm") === true);
  // A viewer may only look: it sees recordings, but makes none.
  expect(await page.getByTestId("record").isDisabled()).toBe(true);
  expect(await page.getByTestId("record").getAttribute("title")).toContain("viewer");
  expect(await page.getByTestId("recordings").isEnabled()).toBe(true);
  const forbidden = { operator: ["slider", "number", "hold-all", "claim-robot", "claim-world"], admin: ["play", "step", "reset", "speed", "remove"] };
  for (const [role, ids] of Object.entries(forbidden)) {
    for (const id of ids) {
      expect(await page.getByTestId(id).first().isDisabled(), id).toBe(true);
      expect(await page.getByTestId(id).first().getAttribute("title"), id).toContain(`this needs the role ${role}`);
    }
  }
  await page.getByTestId("clients").click();
  expect(await page.getByTestId("who-am-i").textContent()).toContain("You are anna, a viewer.");
  await page.screenshot({ path: `${import.meta.dirname}/../../../target/screenshots/who-am-i.png` });
  await page.keyboard.press("Escape");
  expect(await page.evaluate(() => document.cookie)).toBe("");
  const [cookie] = await context.cookies();
  expect(cookie).toMatchObject({ name: "simd_token", httpOnly: true, secure: true, sameSite: "Strict", expires: -1 });
  // Another tab of the browser has the token too, and another browser does not.
  await Tab.open(context, daemon.url);
  const other = await (await use.context({ ignoreHTTPSErrors: true })).newPage();
  await other.goto(daemon.url);
  await other.getByTestId("log-in").waitFor();
  // After log-out the page asks for a token again.
  await page.getByTestId("clients").click();
  await page.getByTestId("log-out").click();
  await card.waitFor();
  expect(await context.cookies()).toEqual([]);
});
