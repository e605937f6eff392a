// The commands of "How to begin" work as shown, with daemons of each kind.

import { execFile } from "node:child_process";
import { createHash } from "node:crypto";
import { chmod, copyFile, mkdir, mkdtemp, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { dirname, resolve } from "node:path";
import { promisify } from "node:util";

import { expect, test } from "vitest";

import { demoArm } from "../src/load/demo-arm";
import { BINARY, Daemon } from "./daemon";
import { fixtures } from "./fixtures";

const use = fixtures();
const run = promisify(execFile);

const TOKEN = `simd_${"2".repeat(64)}`;
const SIMCTL = resolve(dirname(BINARY), "simctl");

/** A folder with the files that the commands name: a robot, the authority and a token. */
async function folder(): Promise<string> {
  const made = await mkdtemp(`${tmpdir()}/simd-guide-`);
  await mkdir(`${made}/path/to`, { recursive: true });
  await writeFile(`${made}/path/to/robot.urdf`, demoArm());
  await run(BINARY, ["tls", "init", `${made}/tls`]);
  await copyFile(`${made}/tls/ca.pem`, `${made}/ca.pem`);
  await writeFile(`${made}/token.txt`, `${TOKEN}\n`, { mode: 0o600 });
  await writeFile(`${made}/tokens`, `anna admin ${createHash("sha256").update(TOKEN).digest("hex")} never\n`);
  await chmod(`${made}/tokens`, 0o600);
  return made;
}

const KINDS = [
  { name: "without TLS", flags: () => [] },
  { name: "with TLS and tokens", flags: (at: string) => ["--tls-certificate", `${at}/tls/server.pem`, "--tls-key", `${at}/tls/server.key`, "--tokens", `${at}/tokens`] },
] as const;

for (const { name, flags } of KINDS) {
  test(`each command of the help works as it is shown, ${name}`, async () => {
    const at = await folder();
    try {
      const daemon = await use.daemon(Daemon.start([...flags(at)]));
      const page = await (await use.context({ ignoreHTTPSErrors: true })).newPage();
      await page.goto(daemon.url);
      if (daemon.url.startsWith("https:")) {
        await page.getByTestId("token").fill(TOKEN);
        await page.getByTestId("log-in").getByRole("button").click();
      }
      await page.getByTestId("empty-world").waitFor();
      await page.getByTestId("help").click();
      await page.getByTestId("help-begin").click();
      const commands = (await page.getByTestId("guide-command").allTextContents()).filter((text) => text.startsWith("simctl "));
      expect(commands.length).toBe(3);
      const answers: string[] = [];
      for (const command of commands) {
        const [, ...words] = command.split(" ");
        // Without this machine's settings.
        const { stdout } = await run(SIMCTL, words, { cwd: at, env: { PATH: process.env.PATH, HOME: at, XDG_CONFIG_HOME: at } });
        answers.push(stdout);
      }
      expect(answers.at(-1)).toMatch(/demo_arm[\s\S]*ground|ground[\s\S]*demo_arm/);
      await page.keyboard.press("Escape");
      await page.getByTestId("help-sheet").waitFor({ state: "detached" });
      await expect.poll(() => page.getByTestId("slider").count()).toBe(5);
      // The help stays available once robots are loaded.
      await page.keyboard.press("?");
      await page.getByTestId("help-begin").click();
      await page.getByTestId("guide").waitFor();
      await page.screenshot({ path: `${import.meta.dirname}/../../../target/screenshots/how-to-begin-${name.replaceAll(" ", "-")}.png` });
    } finally {
      await rm(at, { recursive: true, force: true });
    }
  });
}
