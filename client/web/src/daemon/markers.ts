// Conversion of programs' drawings from messages to the state of the page, and of input to messages.
import { create } from "@bufbuild/protobuf";
import { InputEventSchema, MouseButton as WireButton, type CameraTarget as WireTarget, type InputEvent, type LinkColors as WireColors, type Marker as Wire } from "../gen/simd/v1/view_pb";
import type { CameraTarget } from "../state/camera";
import type { MouseButton, PageInput } from "../state/input";
import type { Marker, MarkerShape, Rgba, RobotColors } from "../state/markers";
import { vectorOf } from "./mapping";

const BUTTONS: Record<MouseButton, WireButton> = {
  left: WireButton.LEFT,
  middle: WireButton.MIDDLE,
  right: WireButton.RIGHT,
};

/** Returns null for a kind from a newer version of the schema. */
export function markerOf(wire: Wire): Marker | null {
  const { id, robot, link, color } = wire;
  const shape = shapeOf(wire.shape);
  return shape && { id, shape, color: color ? [color.red, color.green, color.blue, color.alpha] : null, robot, link };
}

export function colorsOf({ colors }: WireColors): ReadonlyMap<string, RobotColors> {
  const robots = new Map<string, RobotColors & { links: Map<string, Rgba> }>();
  for (const { robot, link, color, layoutVersion } of colors) {
    if (!color) continue;
    const known = robots.get(robot) ?? { layoutVersion, links: new Map<string, Rgba>() };
    robots.set(robot, known);
    known.links.set(link, [color.red, color.green, color.blue, color.alpha]);
  }
  return robots;
}

function shapeOf(shape: Wire["shape"]): MarkerShape | null {
  switch (shape.case) {
    case "lines":
      return { kind: "lines", points: shape.value.points, colors: shape.value.colors, width: shape.value.width };
    case "points":
      return { kind: "points", points: shape.value.points, colors: shape.value.colors, size: shape.value.size };
    case "text": {
      const { text, position, orientation: q, size } = shape.value;
      return { kind: "text", text, position: vectorOf(position), orientation: q ? [q.x, q.y, q.z, q.w] : null, size };
    }
    default:
      return null;
  }
}

export function cameraTargetOf({ version, position, target, fieldOfView }: WireTarget, isOld: boolean): CameraTarget {
  return { version, position: vectorOf(position), target: vectorOf(target), fieldOfView, isOld };
}

export function inputOf(input: PageInput): InputEvent {
  if (input.kind === "key") {
    const { key, code, isDown } = input;
    return create(InputEventSchema, { kind: { case: "key", value: { key, code, isDown } } });
  }
  const { x, y, button, isDown } = input;
  return create(InputEventSchema, { kind: { case: "mouse", value: { x, y, button: button ? BUTTONS[button] : WireButton.UNSPECIFIED, isDown } } });
}
