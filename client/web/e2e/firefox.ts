// Debian's Firefox, driven by Marionette: its native protocol, which geckodriver translates. Commands and answers follow W3C WebDriver,
// as lengths and JSON over TCP.

import { type ChildProcess, spawn } from "node:child_process";
import { once } from "node:events";
import { existsSync } from "node:fs";
import { mkdir, mkdtemp, rm, writeFile } from "node:fs/promises";
import { connect, type Socket } from "node:net";
import { tmpdir } from "node:os";
import { delimiter, resolve } from "node:path";
import { createInterface } from "node:readline";
import { PassThrough, type Readable } from "node:stream";

import { PICTURES } from "./browser";

const EXECUTABLES = [process.env.FIREFOX, "/usr/bin/firefox-esr", "/usr/bin/firefox"];
/** Timeout of a script in milliseconds, far more than a software renderer needs. */
const TIMEOUT = 120_000;

/** Preferences of its profile: no first page, no updates, no reports, and WebGL also in software. */
const PREFERENCES: Record<string, string | number | boolean> = {
  "marionette.port": 0,
  "webgl.force-enabled": true,
  "browser.startup.page": 0,
  "browser.shell.checkDefaultBrowser": false,
  "browser.aboutwelcome.enabled": false,
  "app.update.enabled": false,
  "app.normandy.enabled": false,
  "datareporting.policy.dataSubmissionEnabled": false,
  "toolkit.telemetry.reportingpolicy.firstRun": false,
  "network.captive-portal-service.enabled": false,
  "network.connectivity-service.enabled": false,
  "services.settings.server": "data:,#remote-settings-dummy/v1",
  "extensions.getAddons.cache.enabled": false,
};

interface Point {
  x: number;
  y: number;
}

/** A browser with one page. `close` ends it. */
export class Firefox {
  private constructor(
    private readonly children: readonly ChildProcess[],
    private readonly profile: string,
    private readonly marionette: Marionette,
  ) {}

  /** Starts it with a window of this size on a separate screen: without a screen Firefox has no WebGL. `preferences` are added to the profile. */
  static async start(width: number, height: number, preferences: Record<string, boolean> = {}): Promise<Firefox> {
    const executable = EXECUTABLES.find((path) => path !== undefined && existsSync(path));
    if (executable === undefined) throw new Error("there is no Firefox: `apt-get install firefox-esr`, or name one in FIREFOX");
    if (!(process.env.PATH ?? "").split(delimiter).some((folder) => existsSync(resolve(folder, "Xvfb")))) throw new Error("there is no Xvfb: `apt-get install xvfb`");
    const profile = await mkdtemp(`${tmpdir()}/simd-firefox-`);
    const children: ChildProcess[] = [];
    try {
      const lines = Object.entries({ ...PREFERENCES, ...preferences }).map(([name, value]) => `user_pref(${JSON.stringify(name)}, ${JSON.stringify(value)});`);
      await writeFile(resolve(profile, "user.js"), lines.join("\n"));
      const screen = spawn("Xvfb", ["-displayfd", "3", "-screen", "0", `${width}x${height + 200}x24`, "+extension", "GLX", "-nolisten", "tcp"], { stdio: ["ignore", "ignore", "ignore", "pipe"] });
      children.push(screen);
      const display = `:${await firstLine(screen.stdio[3] as Readable, /^\d+/)}`;
      const env = { ...process.env, DISPLAY: display, HOME: profile, LIBGL_ALWAYS_SOFTWARE: "1", MOZ_CRASHREPORTER_DISABLE: "1" };
      const browser = spawn(executable, ["--marionette", "--no-remote", "--profile", profile, "about:blank"], { env, stdio: ["ignore", "pipe", "pipe"] });
      children.push(browser);
      const said = new PassThrough();
      browser.stdout.pipe(said);
      browser.stderr.pipe(said);
      const port = await firstLine(said, /Marionette\s+INFO\s+Listening on port (\d+)/);
      const marionette = await Marionette.connect(Number(port));
      await marionette.command("WebDriver:NewSession", {});
      await marionette.command("WebDriver:SetTimeouts", { script: TIMEOUT, pageLoad: TIMEOUT });
      const firefox = new Firefox(children, profile, marionette);
      await firefox.resize(width, height);
      return firefox;
    } catch (error) {
      await end(children, profile);
      throw error;
    }
  }

  async close(): Promise<void> {
    this.marionette.close();
    await end(this.children, this.profile);
  }

  async open(url: string): Promise<void> {
    await this.marionette.command("WebDriver:Navigate", { url });
  }

  /**
   * Runs a function in the page, which sees nothing but its arguments. Returns its result, or the value of the promise that it returns.
   */
  async evaluate<Arguments extends unknown[], Result>(run: (...given: Arguments) => Result | Promise<Result>, ...given: Arguments): Promise<Result> {
    const { value } = (await this.marionette.command("WebDriver:ExecuteScript", { script: `return (${String(run)})(...arguments)`, args: given, sandbox: null })) as { value: Result };
    return value;
  }

  /** Waits until a function in the page returns true. */
  async until<Arguments extends unknown[]>(holds: (...given: Arguments) => boolean, ...given: Arguments): Promise<void> {
    const script = `const given = arguments; return (async () => { while (!(${String(holds)})(...given)) await new Promise(requestAnimationFrame); })()`;
    try {
      await this.marionette.command("WebDriver:ExecuteScript", { script, args: given, sandbox: null });
    } catch (error) {
      throw new Error(`${error instanceof Error ? error.message : String(error)}, waiting for ${String(holds)}`, { cause: error });
    }
  }

  /** Returns the centre of the first element with this `data-testid`, on the page. */
  async centre(testId: string): Promise<Point & { width: number }> {
    await this.until((id) => document.querySelector(`[data-testid="${id}"]`) !== null, testId);
    return this.evaluate((id) => {
      const element = document.querySelector(`[data-testid="${id}"]`);
      element?.scrollIntoView({ block: "nearest" });
      const { x = 0, y = 0, width = 0, height = 0 } = element?.getBoundingClientRect() ?? {};
      return { x: x + width / 2, y: y + height / 2, width };
    }, testId);
  }

  /** Clicks on the first element with this `data-testid` once it rests within the window: sheets move in. */
  async click(testId: string): Promise<void> {
    await this.until((id) => {
      const element = document.querySelector(`[data-testid="${id}"]`);
      element?.scrollIntoView({ block: "nearest" });
      const { x, y, width, height } = element?.getBoundingClientRect() ?? new DOMRect();
      const page = window as unknown as { lastPlace?: string };
      const rests = page.lastPlace === `${x} ${y}`;
      page.lastPlace = `${x} ${y}`;
      return element !== null && rests && document.elementFromPoint(x + width / 2, y + height / 2) !== null;
    }, testId);
    const at = await this.centre(testId);
    await this.pointer([moveTo(at), { type: "pointerDown", button: 0 }, { type: "pointerUp", button: 0 }]);
  }

  /** Presses the button at a point, moves to another one in some steps, and releases it. */
  async drag(from: Point, to: Point): Promise<void> {
    const steps = Array.from({ length: 8 }, (_, index) => {
      const share = (index + 1) / 8;
      return moveTo({ x: from.x + share * (to.x - from.x), y: from.y + share * (to.y - from.y) });
    });
    await this.pointer([moveTo(from), { type: "pointerDown", button: 0 }, ...steps, { type: "pointerUp", button: 0 }]);
  }

  /** Presses and releases a key. */
  async press(key: string): Promise<void> {
    const actions = [{ type: "key", id: "keys", actions: ["keyDown", "keyUp"].map((type) => ({ type, value: key })) }];
    await this.marionette.command("WebDriver:PerformActions", { actions });
  }

  /** Chooses a file of this machine in the file field with this `data-testid`. */
  async choose(testId: string, path: string): Promise<void> {
    const { value } = (await this.marionette.command("WebDriver:FindElement", { using: "css selector", value: `[data-testid="${testId}"]` })) as { value: Record<string, string> };
    await this.marionette.command("WebDriver:ElementSendKeys", { id: Object.values(value)[0], text: path });
  }

  /** Returns a PNG of the window, which is saved with the others too. */
  async picture(name: string): Promise<Buffer> {
    const { value } = (await this.marionette.command("WebDriver:TakeScreenshot", { full: false })) as { value: string };
    const png = Buffer.from(value, "base64");
    await mkdir(PICTURES, { recursive: true });
    await writeFile(resolve(PICTURES, `${name}.png`), png);
    return png;
  }

  private async pointer(actions: object[]): Promise<void> {
    await this.marionette.command("WebDriver:PerformActions", { actions: [{ type: "pointer", id: "mouse", parameters: { pointerType: "mouse" }, actions }] });
  }

  /** Gives the page, not the window, this size. */
  async resize(width: number, height: number): Promise<void> {
    const [across, down] = await this.evaluate(() => [outerWidth - innerWidth, outerHeight - innerHeight]);
    await this.marionette.command("WebDriver:SetWindowRect", { x: 0, y: 0, width: width + (across ?? 0), height: height + (down ?? 0) });
  }
}

function moveTo({ x, y }: Point): object {
  return { type: "pointerMove", x: Math.round(x), y: Math.round(y), duration: 10, origin: "viewport" };
}

/** The connection: one command at a time. */
class Marionette {
  private received = Buffer.alloc(0);
  private last = 0;
  private readonly waiting = new Map<number, { done: (result: unknown) => void; failed: (error: Error) => void }>();
  private greeted: () => void = () => undefined;

  private constructor(private readonly socket: Socket) {
    socket.on("data", (data) => this.take(data));
    const ended = (): void => {
      for (const { failed } of this.waiting.values()) failed(new Error("Firefox has ended the connection"));
      this.waiting.clear();
    };
    socket.on("close", ended);
    socket.on("error", ended);
  }

  static async connect(port: number): Promise<Marionette> {
    const socket = connect(port, "127.0.0.1");
    const marionette = new Marionette(socket);
    const greeting = new Promise<void>((done) => (marionette.greeted = done));
    await once(socket, "connect");
    await greeting;
    return marionette;
  }

  command(name: string, parameters: object): Promise<unknown> {
    const id = (this.last += 1);
    const text = Buffer.from(JSON.stringify([0, id, name, parameters]));
    const answer = new Promise((done, failed) => this.waiting.set(id, { done, failed }));
    this.socket.write(Buffer.concat([Buffer.from(`${text.length}:`), text]));
    return answer;
  }

  close(): void {
    this.socket.destroy();
  }

  private take(data: Buffer): void {
    this.received = Buffer.concat([this.received, data]);
    for (;;) {
      const colon = this.received.indexOf(":");
      const end = colon + 1 + Number(this.received.toString("latin1", 0, Math.max(0, colon)));
      if (colon < 0 || this.received.length < end) return;
      const message: unknown = JSON.parse(this.received.toString("utf8", colon + 1, end));
      this.received = this.received.subarray(end);
      // The first message names the protocol.
      if (Array.isArray(message)) this.answered(message as [number, number, { error: string; message: string } | null, unknown]);
      else this.greeted();
    }
  }

  private answered([, id, error, result]: [number, number, { error: string; message: string } | null, unknown]): void {
    const call = this.waiting.get(id);
    this.waiting.delete(id);
    if (error) call?.failed(new Error(`${error.error}: ${error.message}`));
    else call?.done(result);
  }
}

/** Returns the match of a pattern in the first line that it fits: its group, or all of it. */
async function firstLine(stream: Readable, pattern: RegExp): Promise<string> {
  for await (const line of createInterface({ input: stream })) {
    const found = pattern.exec(line);
    if (!found) continue;
    // Later output is not kept, and must not fill the pipe.
    stream.resume();
    return found[1] ?? found[0];
  }
  throw new Error(`a program ended before it said ${pattern}`);
}

async function end(children: readonly ChildProcess[], profile: string): Promise<void> {
  // The browser ends before its screen.
  for (const child of children.toReversed()) {
    if (child.exitCode !== null || child.signalCode !== null) continue;
    const gone = once(child, "exit");
    child.kill("SIGTERM");
    await gone;
  }
  await rm(profile, { recursive: true, force: true, maxRetries: 5 });
}
