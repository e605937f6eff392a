// Pulling on links, and loading folders.

import { resolve } from "node:path";

import { expect, test } from "vitest";

import { Tab } from "./browser";
import { Daemon, REPOSITORY } from "./daemon";
import { corners, moved } from "./mesh";
import { fixtures } from "./fixtures";

const use = fixtures();

test("a dragged link follows the pointer until the button is released", async () => {
  // Without gravity nothing else moves the arm.
  const daemon = await use.daemon(Daemon.start(["--config", "tests/assets/demo.toml", "--gravity", "0,0,0"]));
  const context = await use.context();
  const tab = await Tab.open(context, daemon.url);
  await daemon.joints.setJointTargets({
    robots: [{ robot: "bench_arm", joints: [{ joint: "shoulder", target: { case: "passive", value: {} } }] }],
  });
  const pose = await daemon.linkPose("bench_arm", "arm");
  const points = await corners(resolve(REPOSITORY, "tests/assets/Bench_Arm-1.2 rev B/meshes/arm.STL"));
  const far = points.reduce((best, point) => ((point[0] ?? 0) > (best[0] ?? 0) ? point : best));
  // Slightly inside of the arm's end, where the pointer surely meets it.
  const { x, y } = await tab.project(moved(pose, [0.85 * (far[0] ?? 0), far[1] ?? 0, 0]));
  const start = (await daemon.joint("bench_arm", "shoulder")).position;
  await tab.page.mouse.move(x, y);
  await tab.page.mouse.down();
  await tab.page.mouse.move(x, y - 120, { steps: 6 });
  await expect.poll(async () => Math.abs((await daemon.joint("bench_arm", "shoulder")).position - start)).toBeGreaterThan(0.05);
  await tab.page.mouse.up();
  // After the pull nothing brakes or drives the arm, and its velocity is constant. The page's last call may come late.
  const change = async (): Promise<number> => {
    const { velocity } = await daemon.joint("bench_arm", "shoulder");
    await daemon.pass(0.2);
    return (await daemon.joint("bench_arm", "shoulder")).velocity - velocity;
  };
  await expect.poll(change).toBeCloseTo(0, 6);
});

test("a page that draws three pictures a second pulls a link as well", async () => {
  const daemon = await use.daemon(Daemon.start(["--config", "tests/assets/demo.toml", "--gravity", "0,0,0"]));
  const tab = await Tab.open(await use.context(), daemon.url);
  await daemon.joints.setJointTargets({
    robots: [{ robot: "bench_arm", joints: [{ joint: "shoulder", target: { case: "passive", value: {} } }] }],
  });
  const pose = await daemon.linkPose("bench_arm", "arm");
  const points = await corners(resolve(REPOSITORY, "tests/assets/Bench_Arm-1.2 rev B/meshes/arm.STL"));
  const far = points.reduce((best, point) => ((point[0] ?? 0) > (best[0] ?? 0) ? point : best));
  const { x, y } = await tab.project(moved(pose, [0.85 * (far[0] ?? 0), far[1] ?? 0, 0]));
  // Each animation frame comes a third of a second after its request.
  await tab.page.evaluate(() => {
    window.requestAnimationFrame = (draw) => window.setTimeout(() => draw(performance.now()), 330);
  });
  const angle = async () => (await daemon.joint("bench_arm", "shoulder")).position;
  const start = await angle();
  await tab.page.mouse.move(x, y);
  await tab.page.mouse.down();
  await tab.page.mouse.move(x, y - 120, { steps: 6 });
  await expect.poll(async () => Math.abs((await angle()) - start)).toBeGreaterThan(0.05);
  // It comes to rest at the pointer and does not swing about it.
  const change = async (): Promise<number> => {
    const before = await angle();
    await daemon.pass(0.5);
    return Math.abs((await angle()) - before);
  };
  await expect.poll(change).toBeLessThan(0.01);
  await tab.page.mouse.up();
});

test("a folder that is chosen becomes a robot, with its report", async () => {
  const daemon = await use.daemon(Daemon.start([]));
  const context = await use.context();
  const tab = await Tab.open(context, daemon.url);
  await tab.page.getByTestId("empty-world").waitFor();
  await tab.picture("empty-world");
  await tab.page.getByTestId("folder-input").first().setInputFiles(resolve(REPOSITORY, "tests/assets/Two Link.v2"));
  await tab.page.getByTestId("load-now").click();
  await expect.poll(() => tab.page.getByTestId("slider").count()).toBe(2);
  const { entities } = await daemon.entities.listEntities({});
  expect(entities.map((entity) => entity.movingJoints)).toEqual([2]);
  await tab.page.getByTestId("report").first().click();
  await expect.poll(() => tab.page.getByTestId("report-sheet").textContent()).toContain("axis");
  await tab.picture("report");
});
