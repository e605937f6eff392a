// The colours of the scene, light and dark.

/** One theme's colours, as numbers 0xRRGGBB. */
export interface Palette {
  background: number;
  /** Planes. */
  ground: number;
  /** Grid lines. */
  grid: number;
  sky: number;
  /** Colour of markers without a colour. */
  ink: number;
  /** Light from below. */
  earth: number;
  skyIntensity: number;
  sunIntensity: number;
}

export const PALETTES: Record<"light" | "dark", Palette> = {
  light: {
    background: 0xeceff3,
    ground: 0xdfe3e8,
    grid: 0x8792a2,
    ink: 0x1c2430,
    sky: 0xffffff,
    earth: 0xb9bec6,
    skyIntensity: 1.9,
    sunIntensity: 2.1,
  },
  dark: {
    background: 0x14171c,
    ground: 0x20242b,
    grid: 0x6c7788,
    ink: 0xf1f5fa,
    sky: 0xdfe8f5,
    earth: 0x3c424d,
    skyIntensity: 1.5,
    sunIntensity: 2.2,
  },
};

/** Shapes without a colour. */
export const UNCOLOURED = 0xa3adba;
/** Added to the colour of a highlighted link. */
export const HIGHLIGHT = 0x2f7fd6;
export const COLLISION = 0x2fae74;
export const MISSING = 0xd9822b;
export const PULL = 0x2f7fd6;
export const CONTACT = 0xd94f3d;
/** Robots of a recording next to the live ones. */
export const GHOST = 0x7c5cff;
/** Axes of turning joints, and of sliding joints. */
export const TURNS = 0x0e9fb5;
export const SLIDES = 0xb5489f;
/** Centres of mass of a link and of a whole robot. */
export const MASS = 0xe0a526;
export const WHOLE_MASS = 0xd94f3d;
export const CONSTRAINT = 0x1f9d8f;
/** Colour of constraints that reach their bound. */
export const SATURATED = 0xd9822b;
