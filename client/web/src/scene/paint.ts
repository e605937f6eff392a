// Materials, made once for each colour, and their twins that light up under the pointer.
import { Color, DoubleSide, FrontSide, MeshBasicMaterial, MeshStandardMaterial, SRGBColorSpace, type Material } from "three";
import type { Shape } from "../state/scene";
import { COLLISION, HIGHLIGHT, MISSING, UNCOLOURED } from "./palette";

type Rgba = NonNullable<Shape["color"]>;

/** All materials but those that meshes bring. */
export class Paints {
  private readonly solids = new Map<string, MeshStandardMaterial>();
  private readonly lit = new Map<Material, Material>();
  /** Translucent, with both sides, so that what is within shows. */
  readonly collision = new MeshStandardMaterial({
    color: COLLISION,
    transparent: true,
    opacity: 0.22,
    depthWrite: false,
    side: DoubleSide,
    roughness: 1,
  });
  readonly wire = new MeshBasicMaterial({ color: COLLISION, wireframe: true, transparent: true, opacity: 0.35 });
  readonly missing = new MeshBasicMaterial({ color: MISSING, wireframe: true });
  readonly ground = new MeshStandardMaterial({ roughness: 1, metalness: 0 });

  constructor() {
    // Lines of the grid lie in the same plane.
    this.ground.polygonOffset = true;
    this.ground.polygonOffsetFactor = 1;
    this.ground.polygonOffsetUnits = 1;
  }

  /** Of a colour as the description gives it, or of the one for shapes without. Meshes may be shells of one layer. */
  solid(color: Rgba | undefined, isShell = false): MeshStandardMaterial {
    const key = `${color?.join() ?? ""} ${isShell}`;
    let material = this.solids.get(key);
    if (!material) {
      const side = isShell ? DoubleSide : FrontSide;
      material = new MeshStandardMaterial({ color: UNCOLOURED, roughness: 0.62, metalness: 0.05, side });
      if (color) {
        const [red, green, blue, alpha] = color;
        material.color = new Color().setRGB(red, green, blue, SRGBColorSpace);
        material.transparent = alpha < 1;
        material.opacity = alpha;
      }
      this.solids.set(key, material);
    }
    return material;
  }

  /** The same, lit up. */
  highlighted(material: Material): Material {
    let twin = this.lit.get(material);
    if (!twin) {
      twin = material.clone();
      if (twin instanceof MeshStandardMaterial) light(twin);
      this.lit.set(material, twin);
    }
    return twin;
  }

  dispose(): void {
    const own = [this.collision, this.wire, this.missing, this.ground];
    for (const material of [...own, ...this.solids.values(), ...this.lit.values()]) material.dispose();
  }
}

/** What is lit up shines in its own colour, which stays what it was; what is bright already is tinted, and what is dark, too. */
function light(material: MeshStandardMaterial): void {
  const accent = new Color(HIGHLIGHT);
  const { r, g, b } = material.color;
  const luminance = 0.2126 * r + 0.7152 * g + 0.0722 * b;
  if (luminance > BRIGHT) {
    material.color.lerp(accent, 0.4);
  } else {
    material.emissive = luminance < DARK ? accent : material.color.clone();
    material.emissiveIntensity = luminance < DARK ? 0.25 : 0.45;
  }
}

/** Luminances. */
const BRIGHT = 0.42;
const DARK = 0.12;
