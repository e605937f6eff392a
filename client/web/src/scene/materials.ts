// Materials, one for each colour and picture, with highlighted variants.
import { Color, DoubleSide, FrontSide, MeshBasicMaterial, MeshStandardMaterial, RepeatWrapping, SRGBColorSpace, TextureLoader, type Material, type Texture } from "three";
import type { Shape } from "../state/scene";
import { COLLISION, HIGHLIGHT, MISSING, UNCOLOURED } from "./palette";

/** Samples of a picture along where it is narrow; browsers take fewer where they cannot. */
const ANISOTROPY = 8;

type Rgba = NonNullable<Shape["color"]> | readonly [number, number, number, number];

/** All materials but those of mesh files. */
export class Materials {
  private readonly solids = new Map<string, MeshStandardMaterial>();
  /** Of `coloured`. */
  private readonly variants = new Map<string, MeshStandardMaterial>();
  private readonly highlights = new Map<Material, Material>();
  private readonly textures = new Map<string, Texture>();
  private loading = 0;
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

  /** The material of a colour, or of the default one, with a picture or without. Meshes may be open shells, which are drawn
   * two-sided. */
  solid(color: Rgba | undefined, isShell = false, texture?: string): MeshStandardMaterial {
    const key = `${color?.join() ?? ""} ${isShell} ${texture ?? ""}`;
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
      if (texture !== undefined) {
        // The picture as it is, where there is no colour.
        if (!color) material.color.set(0xffffff);
        material.map = this.texture(texture);
      }
      this.solids.set(key, material);
    }
    return material;
  }

  /** A material in another colour, which its picture is multiplied by. */
  coloured(material: Material, color: Rgba): Material {
    const map = material instanceof MeshStandardMaterial ? material.map : null;
    const key = `${color.join()} ${material.side} ${map?.uuid ?? ""}`;
    let variant = this.variants.get(key);
    if (!variant) {
      const [red, green, blue, alpha] = color;
      variant = new MeshStandardMaterial({ roughness: 0.62, metalness: 0.05, side: material.side, map });
      variant.color = new Color().setRGB(red, green, blue, SRGBColorSpace);
      variant.transparent = alpha < 1;
      variant.opacity = alpha;
      this.variants.set(key, variant);
    }
    return variant;
  }

  private texture(sha256: string): Texture {
    let texture = this.textures.get(sha256);
    if (!texture) {
      const loaded = () => {
        this.loading -= 1;
        this.changed();
      };
      this.loading += 1;
      // Of either kind: what it is its first bytes say.
      texture = new TextureLoader().load(`/assets/${encodeURIComponent(sha256)}.png`, loaded, undefined, loaded);
      texture.colorSpace = SRGBColorSpace;
      texture.wrapS = texture.wrapT = RepeatWrapping;
      // Of ground that is seen from the side.
      texture.anisotropy = ANISOTROPY;
      this.textures.set(sha256, texture);
    }
    return texture;
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
    for (const texture of this.textures.values()) texture.dispose();
    for (const material of [...own, ...this.solids.values(), ...this.variants.values(), ...this.highlights.values()]) material.dispose();
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
