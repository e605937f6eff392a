// Requests for shapes that are added from the menu.
import type { Spawn } from "../daemon/building";
import { Base } from "../gen/simd/v1/entity_pb";

export type ShapeKind = "box" | "sphere" | "cylinder" | "capsule" | "cone" | "plane" | "heights";

/** Values of the shape form: metres, kilograms. */
export interface ShapeForm {
  kind: ShapeKind;
  name: string;
  /** Size of a box; for a height field, its size with z as the height of its peaks. */
  size: [number, number, number];
  radius: number;
  /** Without the caps of a capsule. */
  length: number;
  /** 0 stands for the mass of water of the same volume. */
  mass: number;
  fixed: boolean;
  /** Centre of the new shape. */
  at: [number, number, number];
  /** "#rrggbb"; empty is none. */
  color: string;
}

/** Returns the fault of a form; undefined if it has none. */
export function problemOf({ kind, size, radius, length, mass }: ShapeForm): string | undefined {
  const positive = (value: number): boolean => Number.isFinite(value) && value > 0;
  if ((kind === "box" || kind === "heights") && !size.every(positive)) return "Each side must be longer than 0.";
  if ((kind === "sphere" || kind === "cylinder" || kind === "capsule" || kind === "cone") && !positive(radius)) return "The radius must be larger than 0.";
  if ((kind === "cylinder" || kind === "cone") && !positive(length)) return "The length must be larger than 0.";
  if (kind === "capsule" && !(length >= 0)) return "The length must be at least 0.";
  if (!(mass >= 0)) return "The mass must be at least 0.";
  return undefined;
}

/**
 * Returns the request for the shape. For a height field, `file` is the SHA-256 of the uploaded picture or table.
 */
export function requestOf(form: ShapeForm, file?: { name: string; sha256: string }): Spawn {
  const { kind, name, fixed, mass, at, color } = form;
  const [x, y, z] = at;
  const isGround = kind === "plane" || kind === "heights";
  const common: Spawn = { name: name === "" ? (isGround ? "ground" : kind) : name, allowRenaming: true, base: fixed || isGround ? Base.FIXED : Base.FREE, pose: { position: { x, y, z } } };
  const tint = color === "" ? {} : { color: colorOf(color) };
  const primitive = { geometry: geometryOf(form, file), ...(isGround ? {} : { mass }), ...tint };
  return { ...common, source: { source: { case: "primitive", value: primitive }, ...(kind === "heights" && file && { assets: { [file.name]: file.sha256 } }) } };
}

type Primitive = Extract<NonNullable<Exclude<NonNullable<Spawn["source"]>, { $typeName: string }>["source"]>, { case: "primitive" }>["value"];
type Geometry = NonNullable<Primitive["geometry"]>;

function geometryOf({ kind, size: [x, y, z], radius, length }: ShapeForm, file?: { name: string }): Geometry {
  switch (kind) {
    case "box":
      return { case: "box", value: { size: { x, y, z } } };
    case "sphere":
      return { case: "sphere", value: { radius } };
    case "cylinder":
      return { case: "cylinder", value: { radius, length } };
    case "capsule":
      return { case: "capsule", value: { radius, length } };
    case "cone":
      return { case: "cone", value: { radius, length } };
    case "plane":
      return { case: "plane", value: {} };
    case "heights":
      return { case: "mesh", value: { uri: file?.name ?? "", scale: { x, y, z } } };
  }
}

function colorOf(text: string): { red: number; green: number; blue: number; alpha: number } {
  const part = (at: number): number => Number.parseInt(text.slice(at, at + 2), 16) / 255;
  return { red: part(1), green: part(3), blue: part(5), alpha: 1 };
}
