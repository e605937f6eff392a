// The light of a bright room, for materials to reflect. Loaded on first use.
import { BackSide, BoxGeometry, Color, Mesh, MeshBasicMaterial, PMREMGenerator, Scene, type WebGLRenderer, type WebGLRenderTarget } from "three";

/** Walls, and luminous panels: brightness, position and size in metres; z is up. */
const WALL = 0.55;
const PANELS: readonly { light: number; at: readonly [number, number, number]; size: readonly [number, number, number] }[] = [
  { light: 9, at: [0, 0, 4.9], size: [5, 3, 0.1] },
  { light: 5, at: [5.9, 2, 2], size: [0.1, 3, 3] },
  { light: 3, at: [-2, -5.9, 1.5], size: [5, 0.1, 2.5] },
  { light: 3, at: [-5.9, 3, 1], size: [0.1, 2, 3] },
];
/** The floor reflects less. */
const FLOOR = 0.3;

/** Draws it, ready for materials of any roughness; the caller disposes of it. */
export function roomOf(renderer: WebGLRenderer): WebGLRenderTarget {
  const room = new Scene();
  const box = new BoxGeometry();
  const materials: MeshBasicMaterial[] = [];
  const add = (light: number, at: readonly [number, number, number], size: readonly [number, number, number], isRoom = false) => {
    const material = new MeshBasicMaterial({ color: new Color(light, light, light), ...(isRoom && { side: BackSide }) });
    materials.push(material);
    const mesh = new Mesh(box, material);
    mesh.position.set(...at);
    mesh.scale.set(...size);
    room.add(mesh);
  };
  add(WALL, [0, 0, 0], [12, 12, 10], true);
  add(FLOOR, [0, 0, -4.9], [11.8, 11.8, 0.1]);
  for (const { light, at, size } of PANELS) add(light, at, size);
  const generator = new PMREMGenerator(renderer);
  try {
    return generator.fromScene(room, 0.04);
  } finally {
    generator.dispose();
    box.dispose();
    for (const material of materials) material.dispose();
  }
}
