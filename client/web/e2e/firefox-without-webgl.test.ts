// Debian's Firefox with WebGL switched off: the page shows the reason in the picture, and everything else works.

import { expect, test } from "vitest";

import { JointMode } from "../src/gen/simd/v1/joint_pb";
import { colouredPixels, inTheMiddle, seenAtMiddle } from "./browser";
import { Daemon } from "./daemon";
import { Firefox } from "./firefox";
import { fixtures } from "./fixtures";

const use = fixtures();
const REASON = "WebGL 2 is missing or switched off";

test("Firefox without WebGL shows the reason in the middle of the picture, and panel, sliders and plots work", async () => {
  const daemon = await use.daemon(Daemon.demo());
  const firefox = await Firefox.start(1280, 720, { "webgl.force-enabled": false, "webgl.disabled": true });
  try {
    await firefox.open(daemon.url);
    await expect.poll(() => firefox.evaluate(inTheMiddle)).toContain(REASON);
    await firefox.until(() => document.querySelectorAll("[data-testid=slider]").length > 0);
    expect((await firefox.evaluate(seenAtMiddle, "[data-testid=slider]")).seen).toBeGreaterThan(0);
    const { robots } = (await daemon.joints.getJointStates({})).states ?? {};
    const robot = robots?.[0]?.robot ?? "";
    const { layout } = await daemon.joints.getJointLayout({ robot });
    const joint = (await firefox.evaluate(() => document.querySelector("[data-testid^=joint-row-]")?.getAttribute("data-testid")))?.split("/")[1] ?? "";
    expect(layout?.joints.map(({ name }) => name)).toContain(joint);
    const slider = await firefox.centre("slider");
    await firefox.drag(slider, { x: slider.x + slider.width / 4, y: slider.y });
    await expect.poll(async () => (await daemon.joint(robot, joint)).target).toBeGreaterThan(0.3);
    await firefox.click("hold-all");
    await expect.poll(async () => (await daemon.joint(robot, joint)).mode).toBe(JointMode.HOLD);
    await firefox.click("plot-joint");
    await expect.poll(() => firefox.evaluate(colouredPixels)).toBeGreaterThan(20);
    expect(await firefox.evaluate(inTheMiddle)).toContain(REASON);
    await firefox.picture("firefox-without-webgl");
  } finally {
    await firefox.close();
  }
});
