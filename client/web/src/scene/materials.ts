// Materials, one for each colour, with highlighted variants.
import { Color, DoubleSide, FrontSide, MeshBasicMaterial, MeshStandardMaterial, SRGBColorSpace, type Material } from "three";
import type { Shape } from "../state/scene";
import { COLLISION, HIGHLIGHT, MISSING, UNCOLOURED } from "./palette";

type Rgba = NonNullable<Shape["color"]>;

/** All materials but those of mesh files. */
export class Materials {
  private readonly solids = new Map<string, MeshStandardMaterial>();
  private readonly highlights = new Map<Material, Material>();
  /** Translucent and two-sided, so that the inside is visible. */
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
    // The grid lies in the same plane.
    this.ground.polygonOffset = true;
    this.ground.polygonOffsetFactor = 1;
    this.ground.polygonOffsetUnits = 1;
  }

  /** The material of a colour, or of the default one. Meshes may be open shells, which are drawn two-sided. */
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

  /** The highlighted variant of a material. */
  highlighted(material: Material): Material {
    let variant = this.highlights.get(material);
    if (!variant) {
      variant = material.clone();
      if (variant instanceof MeshStandardMaterial) highlight(variant);
      this.highlights.set(material, variant);
    }
    return variant;
  }

  dispose(): void {
    const own = [this.collision, this.wire, this.missing, this.ground];
    for (const material of [...own, ...this.solids.values(), ...this.highlights.values()]) material.dispose();
  }
}

/** Adds emission of the own colour; bright and dark colours are tinted instead, on which that would hardly show. */
function highlight(material: MeshStandardMaterial): void {
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
