// Xacro files among others: which is the robot, and what it asks for.
import { expect, test } from "vitest";
import { argumentsIn, findXacros, shownPath } from "./xacro";

test("what becomes a URDF comes first, then what is farther up", () => {
  const paths = ["arm/urdf/macros/hand.xacro", "arm/urdf/inc/deep/arm.urdf.xacro", "arm/urdf/arm.urdf.xacro", "arm/urdf/arm.xacro", "arm/package.xml"];
  expect(findXacros(paths)).toEqual(["arm/urdf/arm.urdf.xacro", "arm/urdf/inc/deep/arm.urdf.xacro", "arm/urdf/arm.xacro", "arm/urdf/macros/hand.xacro"]);
});

test("arguments are those that the file declares, with their defaults", () => {
  const text = `<robot xmlns:xacro="x">
    <!-- <xacro:arg name="old" default="1"/> -->
    <xacro:arg name="ur_type"/>
    <xacro:arg default='' name='prefix'/>
    <xacro:arg
      name="limits" default="$(find ur)/config/&quot;a&quot;.yaml" />
    <xacro:arg name="prefix" default="again"/>
    <xacro:argument name="none"/>
  </robot>`;
  expect(argumentsIn(text)).toEqual([
    { name: "ur_type", preset: undefined },
    { name: "prefix", preset: "" },
    { name: "limits", preset: '$(find ur)/config/"a".yaml' },
  ]);
});

test("files of one name are distinguished by their folders", () => {
  const paths = ["a/arm.urdf.xacro", "b/arm.urdf.xacro", "b/leg.xacro"];
  expect(paths.map((path) => shownPath(path, paths))).toEqual(["a/arm.urdf.xacro", "b/arm.urdf.xacro", "leg.xacro"]);
});
