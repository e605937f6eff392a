// The grid, with lines at a spacing of a metre that fade out with the distance: shaded, or as lines if the processor draws.
import { Color, Mesh, PlaneGeometry, ShaderMaterial, type Object3D } from "three";
import { GridLines } from "./grid-lines";
import type { Palette } from "./palette";

/** Radius in metres; the lines fade out before it. */
const REACH = 200;

const VERTEX = /* glsl */ `
varying vec3 world;
void main() {
  vec4 at = modelMatrix * vec4(position, 1.0);
  world = at.xyz;
  gl_Position = projectionMatrix * viewMatrix * at;
}`;

/** Lines one pixel wide at any distance, by the derivative of the position. */
const FRAGMENT = /* glsl */ `
uniform vec3 colour;
uniform vec2 middle;
uniform float fade;
varying vec3 world;

float lines(float spacing) {
  vec2 at = world.xy / spacing;
  vec2 width = fwidth(at);
  vec2 near = abs(fract(at - 0.5) - 0.5) / width;
  // Lines closer than a few pixels would flicker.
  float clear = 1.0 - smoothstep(0.12, 0.5, max(width.x, width.y));
  return (1.0 - min(min(near.x, near.y), 1.0)) * clear;
}

float axis(float at) {
  return 1.0 - min(abs(at) / fwidth(at), 1.0);
}

void main() {
  float far = 1.0 - smoothstep(0.25, 1.0, distance(world.xy, middle) / fade);
  float strength = max(0.55 * lines(1.0), 0.22 * lines(0.1)) * far;
  float x = axis(world.y) * far;
  float y = axis(world.x) * far;
  vec3 shown = mix(mix(colour, vec3(0.85, 0.28, 0.25), x), vec3(0.28, 0.62, 0.3), y);
  gl_FragColor = vec4(shown, max(strength, 0.6 * max(x, y)));
  if (gl_FragColor.a < 0.003) discard;
  #include <colorspace_fragment>
}`;

/** The grid, which is not part of the simulation: it takes no shadow, so that it does not look solid. */
export class Grid {
  private readonly lines: ShaderMaterial;
  private readonly plane = new PlaneGeometry(2 * REACH, 2 * REACH);
  private readonly grid: Mesh;
  private readonly cheap = new GridLines();
  private shown = true;
  private isCheap = false;

  constructor(parent: Object3D) {
    this.lines = new ShaderMaterial({
      uniforms: { colour: { value: new Color() }, middle: { value: [0, 0] }, fade: { value: 10 } },
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      transparent: true,
      depthWrite: false,
      side: 2,
      // Drawn before ground in the same plane.
      polygonOffset: true,
      polygonOffsetFactor: -2,
      polygonOffsetUnits: -8,
    });
    this.grid = new Mesh(this.plane, this.lines);
    this.grid.renderOrder = 1;
    parent.add(this.grid, this.cheap.lines);
  }

  paint(palette: Palette): void {
    (this.lines.uniforms["colour"]?.value as Color).set(palette.grid);
    this.cheap.paint(palette.grid);
  }

  show(shown: boolean): void {
    this.shown = shown;
    this.apply();
  }

  /** Draws lines only, instead of each pixel of the ground. */
  simplify(isCheap: boolean): void {
    this.isCheap = isCheap;
    this.apply();
  }

  private apply(): void {
    this.grid.visible = this.shown && !this.isCheap;
    this.cheap.lines.visible = this.shown && this.isCheap;
  }

  /** Centres the grid on the camera's target; the fade distance grows with the camera's distance. */
  follow(x: number, y: number, distance: number): void {
    const reach = Math.min(REACH, Math.max(4, 5 * distance));
    if (this.cheap.lines.visible) this.cheap.follow(x, y, reach);
    const { middle, fade } = this.lines.uniforms;
    if (middle) middle.value = [x, y];
    if (fade) fade.value = reach;
  }

  dispose(): void {
    this.plane.dispose();
    this.lines.dispose();
    this.cheap.dispose();
  }
}
