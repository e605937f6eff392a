// Which files of what was dropped are robots, and in which order.

import { expect, test } from "vitest";
import { findUrdfs } from "./urdfs";

test("a URDF comes before other formats, and manifests are none", () => {
  expect(findUrdfs(["/d/a.urdf", "/d/world.sdf", "/d/package.xml"])).toEqual(["/d/a.urdf"]);
  expect(findUrdfs(["/d/world.sdf", "/d/scene.xml"])).toEqual(["/d/world.sdf"]);
  expect(findUrdfs(["/d/scene.xml", "/d/parts/leg.xml", "/d/package.xml"])).toEqual(["/d/scene.xml"]);
  expect(() => findUrdfs(["/d/package.xml", "/d/a.stl"])).toThrow("nor a xacro, SDF or MJCF");
});
