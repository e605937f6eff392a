// Arguments that a xacro file declares.
import { expect, test } from "vitest";
import { argumentsIn } from "./xacro";

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
