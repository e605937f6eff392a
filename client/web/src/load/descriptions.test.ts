// Descriptions of robots among dropped files, and their order.

import { expect, test } from "vitest";
import { findDescriptions, shownPath } from "./descriptions";

const file = (path: string, text = "") => ({ path, file: new File([text], path) });
const paths = async (...files: { path: string; file: File }[]) => (await findDescriptions(files)).map(({ path }) => path);

test("a URDF comes before other formats, and manifests and launch files are none", async () => {
  expect(await paths(file("d/package.xml", "<package/>"), file("d/world.sdf"), file("d/a.urdf"))).toEqual(["d/a.urdf", "d/world.sdf"]);
  expect(await paths(file("d/scene.xml", "<?xml version='1.0'?><!-- <robot/> --><mujoco/>"), file("d/arm.xacro"), file("d/go.xml", "<launch/>"))).toEqual(["d/arm.xacro", "d/scene.xml"]);
  expect(await paths(file("d/package.xml", "<package/>"), file("d/a.stl"))).toEqual([]);
});

test("the topmost come first, and a folder urdf counts as its parent", async () => {
  expect(await paths(file("d/test/b.urdf"), file("d/urdf/c.urdf"), file("d/a.urdf"))).toEqual(["d/a.urdf", "d/urdf/c.urdf", "d/test/b.urdf"]);
});

test("links are counted by the elements of each format", async () => {
  const urdf = '<robot name="a"><link name="b"/><!-- <link name="x"/> --><link name="c"/><joint><parent link="b"/></joint></robot>';
  expect(await findDescriptions([file("a.urdf", urdf), file("b.xml", "<mujoco><body/><body name='x'/></mujoco>"), file("c.xacro", urdf)])).toEqual([
    { path: "a.urdf", kind: "URDF", links: 2 },
    { path: "c.xacro", kind: "xacro" },
    { path: "b.xml", kind: "MJCF", links: 2 },
  ]);
});

test("files of one name differ by their folders", () => {
  expect(shownPath("a/x.urdf", ["a/x.urdf", "a/y.urdf"])).toBe("x.urdf");
  expect(shownPath("a/x.urdf", ["a/x.urdf", "b/x.urdf"])).toBe("a/x.urdf");
});
