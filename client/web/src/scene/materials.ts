// Materials, one for each colour and picture; and variants of them, which belong to their users.
import { Color, DoubleSide, FrontSide, MeshBasicMaterial, MeshStandardMaterial, RepeatWrapping, SRGBColorSpace, TextureLoader, type Material, type Texture } from "three";
import type { Shape } from "../state/scene";
import { COLLISION, HIGHLIGHT, MISSING, UNCOLOURED } from "./palette";
import { Surface } from "./surface";

/** Samples of a picture along its narrow direction; browsers limit them. */
const ANISOTROPY = 8;

type Rgba = NonNullable<Shape["color"]> | readonly [number, number, number, number];

/** All materials except those of mesh files. */
export class Materials {
  private readonly solids = new Map<string, MeshStandardMaterial>();
  private readonly textures = new Map<string, Texture>();
  private loading = 0;
  /** Translucent and two-sided, so that the inside is visible. */
  readonly collision = new Surface({
    color: COLLISION,
    transparent: true,
    opacity: 0.22,
    depthWrite: false,
    side: DoubleSide,
    roughness: 1,
  });
  readonly wire = new MeshBasicMaterial({ color: COLLISION, wireframe: true, transparent: true, opacity: 0.35 });
  readonly missing = new MeshBasicMaterial({ color: MISSING, wireframe: true });
  readonly ground = new Surface({ roughness: 1, metalness: 0 });

  /** `changed` is called when a picture was loaded. */
  constructor(private readonly changed: () => void = () => undefined) {
    // The grid lies in the same plane.
    this.ground.polygonOffset = true;
    this.ground.polygonOffsetFactor = 1;
    this.ground.polygonOffsetUnits = 1;
  }

  /** Whether no picture is being loaded. */
  isComplete(): boolean {
    return this.loading === 0;
  }

  /**
   * Returns the material of a colour, or of the default one, with a picture or without. Meshes may be open shells, which are
   * drawn two-sided.
   */
  solid(color: Rgba | undefined, isShell = false, texture?: string): MeshStandardMaterial {
    const key = `${color?.join() ?? ""} ${isShell} ${texture ?? ""}`;
    let material = this.solids.get(key);
    if (!material) {
      const side = isShell ? DoubleSide : FrontSide;
      material = new Surface({ color: UNCOLOURED, ...FINISH, side });
      if (color) tint(material, color);
      if (texture !== undefined) {
        // Without a colour the picture is unchanged.
        if (!color) material.color.set(0xffffff);
        material.map = this.texture(texture);
      }
      this.solids.set(key, material);
    }
    return material;
  }

  private texture(sha256: string): Texture {
    let texture = this.textures.get(sha256);
    if (!texture) {
      const loaded = () => {
        this.loading -= 1;
        this.changed();
      };
      this.loading += 1;
      // The first bytes tell PNG from JPEG.
      texture = new TextureLoader().load(`/assets/${encodeURIComponent(sha256)}.png`, loaded, undefined, loaded);
      texture.colorSpace = SRGBColorSpace;
      texture.wrapS = texture.wrapT = RepeatWrapping;
      // Sharpens ground that is seen from the side.
      texture.anisotropy = ANISOTROPY;
      this.textures.set(sha256, texture);
    }
    return texture;
  }

  dispose(): void {
    const own = [this.collision, this.wire, this.missing, this.ground];
    for (const texture of this.textures.values()) texture.dispose();
    for (const material of [...own, ...this.solids.values()]) material.dispose();
  }
}

/**
 * Returns a material for `tint`, with the picture of a material. The caller disposes of it: programs may change colours with
 * each state.
 */
export function colourable(material: Material): MeshStandardMaterial {
  const map = material instanceof MeshStandardMaterial ? material.map : null;
  return new Surface({ ...FINISH, side: material.side, map });
}

/** Gives a material a colour, which multiplies its picture. */
export function tint(material: MeshStandardMaterial, [red, green, blue, alpha]: Rgba): void {
  material.color.setRGB(red, green, blue, SRGBColorSpace);
  // Transparent materials use a different shader program.
  if (material.transparent !== (alpha < 1)) material.needsUpdate = true;
  material.transparent = alpha < 1;
  material.opacity = alpha;
}

/** Returns the highlighted variant of a material. The caller disposes of it. */
export function highlighted(material: Material): Material {
  const variant = material.clone();
  if (variant instanceof MeshStandardMaterial) highlight(variant);
  return variant;
}

/**
 * Adds emission of the material's colour. Bright and dark colours are tinted instead, since emission would hardly show on
 * them.
 */
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

/** Finish of surfaces without a material. */
const FINISH = { roughness: 0.62, metalness: 0.05 };
/** Luminances. */
const BRIGHT = 0.42;
const DARK = 0.12;
