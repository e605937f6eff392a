// The commands of "How to begin" work as shown, with daemons of each kind.

import { execFile } from "node:child_process";
import { createHash } from "node:crypto";
import { chmod, copyFile, mkdir, mkdtemp, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { dirname, resolve } from "node:path";
import { promisify } from "node:util";

import { expect, test } from "vitest";

import { demoArm } from "../src/load/demo-arm";
import { BINARY, Daemon, REPOSITORY } from "./daemon";
import { fixtures } from "./fixtures";

const use = fixtures();
const run = promisify(execFile);

const TOKEN = `simd_${"2".repeat(64)}`;
const SIMCTL = resolve(dirname(BINARY), "simctl");
/** Python with the client, which `make test-web` installs. */
const PYTHON = resolve(REPOSITORY, "target/python-venv/bin/python");

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
  { name: "without TLS", zenoh: "tcp", flags: () => [] },
  { name: "with TLS and tokens", zenoh: "tls", flags: (at: string) => ["--tls-certificate", `${at}/tls/server.pem`, "--tls-key", `${at}/tls/server.key`, "--tokens", `${at}/tokens`] },
] as const;

for (const { name, zenoh, flags } of KINDS) {
  test(`each command and program of the help works as it is shown, ${name}`, async () => {
    const at = await folder();
    // Without this machine's settings.
    const where = { cwd: at, env: { PATH: process.env.PATH, HOME: at, XDG_CONFIG_HOME: at } };
    try {
      const daemon = await use.daemon(Daemon.start(["--zenoh", `${zenoh}/127.0.0.1:0`, ...flags(at)]));
      const page = await (await use.context({ ignoreHTTPSErrors: true })).newPage();
      await page.goto(daemon.url);
      if (daemon.url.startsWith("https:")) {
        await page.getByTestId("token").fill(TOKEN);
        await page.getByTestId("log-in").getByRole("button").click();
      }
      await page.getByTestId("empty-world").waitFor();
      await page.getByTestId("help").click();
      await page.getByTestId("help-begin").click();
      // The page says where Zenoh is, which the program asks the same port for.
      await expect.poll(() => page.getByTestId("guide-zenoh").textContent()).toMatch(new RegExp(`\\(${zenoh}/127\\.0\\.0\\.1:\\d+\\)`));
      const shown = await page.getByTestId("guide-command").allTextContents();
      const runProgram = async (texts: readonly string[]): Promise<void> => {
        await run(PYTHON, ["-c", (texts.at(-1) ?? "").replace("simd_...", TOKEN)], where);
      };
      if (daemon.url.startsWith("http:")) {
        await runProgram(shown);
        expect((await daemon.joint("demo_arm", "elbow")).target).toBe(0.5);
        await daemon.entities.deleteEntity({ robot: "demo_arm" });
      }
      const commands = shown.filter((text) => text.startsWith("simctl "));
      expect(commands.length).toBe(3);
      const answers: string[] = [];
      for (const command of commands) {
        const [, ...words] = command.split(" ");
        const { stdout } = await run(SIMCTL, words, where);
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
      await expect.poll(() => page.getByTestId("guide-zenoh").getAttribute("data-way")).toBe("reached");
      await runProgram(await page.getByTestId("guide-command").allTextContents());
      await expect.poll(() => page.getByTestId("number").first().inputValue()).toBe("0.500 rad");
      await page.screenshot({ path: `${import.meta.dirname}/../../../target/screenshots/how-to-begin-${name.replaceAll(" ", "-")}.png` });
    } finally {
      await rm(at, { recursive: true, force: true });
    }
  });
}
