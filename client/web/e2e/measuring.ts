// Shared parts of the figures: robots that swing a joint, and the use of a page and its browser meanwhile.

import type { Tab } from "./browser";
import type { Daemon } from "./daemon";

export const pause = (milliseconds: number): Promise<void> => new Promise((done) => setTimeout(done, milliseconds));

/** Lets equal robots swing their first limited joint to and fro, so that each picture differs. Returns a function that ends it. */
export async function swing(daemon: Daemon, robots: readonly string[], velocity: number, interval: number): Promise<() => Promise<void>> {
  const { layout } = await daemon.joints.getJointLayout({ robot: robots[0] ?? "" });
  const joint = layout?.joints.find(({ limits, mimic }) => limits !== undefined && !mimic)?.name ?? "";
  let way = -velocity;
  const turn = (): void => {
    way = -way;
    void daemon.joints.setJointTargets({ robots: robots.map((robot) => ({ robot, joints: [{ joint, target: { case: "velocity", value: { velocity: way } } as const }] })) });
  };
  turn();
  const timer = setInterval(turn, interval);
  return async () => {
    clearInterval(timer);
    await daemon.joints.setJointTargets({ robots: robots.map((robot) => ({ robot, joints: [{ joint, target: { case: "hold", value: {} } as const }] })) });
  };
}

/** Counts of a page while it was measured: states, pictures, and seconds of a core. */
export interface Use {
  /** Wall seconds. */
  seconds: number;
  states: number;
  pictures: number;
  /** Seconds of scripts, and of all computing in the page's main thread. */
  script: number;
  busy: number;
  /** Seconds of the browser's processes. */
  gpu: number;
  browser: number;
  renderer: number;
}

/** Measures a page for this many milliseconds. */
export async function used(tab: Tab, span: number): Promise<Use> {
  const context = tab.page.context();
  const session = await context.newCDPSession(tab.page);
  await session.send("Performance.enable");
  const whole = await context.browser()?.newBrowserCDPSession();
  const read = async (): Promise<Use> => {
    const { metrics } = await session.send("Performance.getMetrics");
    const metric = (wanted: string): number => metrics.find(({ name }) => name === wanted)?.value ?? 0;
    const { processInfo = [] } = (await whole?.send("SystemInfo.getProcessInfo")) ?? {};
    const time = (type: string): number => processInfo.filter((each) => each.type === type).reduce((sum, { cpuTime }) => sum + cpuTime, 0);
    const [states, pictures] = await tab.page.evaluate(() => [window.simd.stats.frames(), window.simd.stats.pictures()] as const);
    return { seconds: performance.now() / 1e3, states, pictures, script: metric("ScriptDuration"), busy: metric("ThreadTime"), gpu: time("GPU"), browser: time("browser"), renderer: time("renderer") };
  };
  const before = await read();
  await pause(span);
  const after = await read();
  await session.detach();
  await whole?.detach();
  return Object.fromEntries(Object.entries(after).map(([name, value]) => [name, value - before[name as keyof Use]])) as unknown as Use;
}
