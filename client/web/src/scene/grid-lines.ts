// The grid as lines: a processor that draws needs a third of a picture's time for the shaded one.
import { BufferAttribute, BufferGeometry, Color, LineBasicMaterial, LineSegments } from "three";

/** Metres between lines, the finest first, and the opacity of each. */
const KINDS = [
  { spacing: 0.1, opacity: 0.16 },
  { spacing: 1, opacity: 0.5 },
  { spacing: 10, opacity: 0.5 },
] as const;
/** Maximum number of lines in one direction on one side of the middle: closer ones would flicker. */
const MAX = 120;
/** Number of steps in which a line fades. */
const PARTS = 10;
/** Relative changes of the reach and of the middle after which the grid is rebuilt. */
const ZOOMED = 1.25;
const MOVED = 0.1;
const X_AXIS = [0.85, 0.28, 0.25] as const;
const Y_AXIS = [0.28, 0.62, 0.3] as const;
const AXIS_OPACITY = 0.6;
/** Height above the ground, as a share of the reach. */
const LIFT = 2e-5;

/** One end of a line: metres, and the weights of its colour. */
type Corner = readonly [x: number, y: number, red: number, green: number, blue: number, opacity: number];

/** Returns ends of the lines around a middle that fade out at a reach, two a segment: metres. */
export function gridCorners(x: number, y: number, reach: number, colour: readonly [number, number, number]): Corner[] {
  const corners: Corner[] = [];
  // The coarser of two fitting spacings has brighter lines, over the finer.
  const fitting = KINDS.filter(({ spacing }) => reach / spacing <= MAX && reach / spacing >= 1);
  for (const { spacing, opacity } of fitting) {
    for (const isAlongX of [true, false]) {
      const across = isAlongX ? y : x;
      for (let line = Math.ceil((across - reach) / spacing); line * spacing <= across + reach; line += 1) {
        const [red, green, blue] = line !== 0 ? colour : isAlongX ? X_AXIS : Y_AXIS;
        const from = line * spacing - across;
        const half = Math.sqrt(Math.max(0, reach * reach - from * from));
        const corner = (step: number): Corner => {
          const along = half * ((2 * step) / PARTS - 1);
          const strength = faded(Math.hypot(along, from) / reach) * (line === 0 ? AXIS_OPACITY : opacity);
          return isAlongX ? [x + along, y + from, red, green, blue, strength] : [x + from, y + along, red, green, blue, strength];
        };
        for (let step = 0; step < PARTS; step += 1) corners.push(corner(step), corner(step + 1));
      }
    }
  }
  return corners;
}

/** Fades like the shaded grid: GLSL's `1 - smoothstep(0.25, 1, share)`. */
function faded(share: number): number {
  const t = Math.min(1, Math.max(0, (share - 0.25) / 0.75));
  return 1 - t * t * (3 - 2 * t);
}

/** Lines that follow the camera's target. */
export class GridLines {
  readonly lines: LineSegments<BufferGeometry, LineBasicMaterial>;
  private readonly colour = new Color();
  private made: { x: number; y: number; reach: number } | undefined;

  constructor() {
    this.lines = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ vertexColors: true, transparent: true, depthWrite: false, fog: false }));
    this.lines.renderOrder = 1;
    this.lines.frustumCulled = false;
    this.lines.visible = false;
  }

  paint(colour: number): void {
    this.colour.set(colour);
    this.made = undefined;
  }

  /** Metres. */
  follow(x: number, y: number, reach: number): void {
    const { made } = this;
    const isFitting = made && reach < made.reach * ZOOMED && reach > made.reach / ZOOMED && Math.hypot(x - made.x, y - made.y) < MOVED * made.reach;
    if (isFitting) return;
    this.made = { x, y, reach };
    const { r, g, b } = this.colour;
    const corners = gridCorners(x, y, reach, [r, g, b]);
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(new Float32Array(corners.flatMap(([at, up]) => [at, up, LIFT * reach])), 3));
    geometry.setAttribute("color", new BufferAttribute(new Float32Array(corners.flatMap(([, , red, green, blue, opacity]) => [red, green, blue, opacity])), 4));
    this.lines.geometry.dispose();
    this.lines.geometry = geometry;
  }

  dispose(): void {
    this.lines.geometry.dispose();
    this.lines.material.dispose();
  }
}
