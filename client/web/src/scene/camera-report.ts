// Reports the camera to programs that ask.
import { MathUtils, type Vector2 } from "three";
import { shownCamera, type ShownCamera } from "../state/camera";
import type { Camera } from "./camera";

/** Reports the camera of a picture of this size, if it has changed. */
export function reportCamera({ camera, controls }: Camera, size: Vector2, followed: bigint): void {
  const now: ShownCamera = {
    position: camera.position.toArray(),
    target: controls.target.toArray(),
    fieldOfView: MathUtils.degToRad(camera.fov),
    width: Math.max(1, Math.round(size.x)),
    height: Math.max(1, Math.round(size.y)),
    followed,
  };
  const before = shownCamera.peek();
  if (!before || !isSame(before, now)) shownCamera.value = now;
}

function isSame(a: ShownCamera, b: ShownCamera): boolean {
  const numbers = ({ position, target, fieldOfView, width, height }: ShownCamera) => [...position, ...target, fieldOfView, width, height];
  const [before, now] = [numbers(a), numbers(b)];
  return a.followed === b.followed && before.every((number, index) => number === now[index]);
}
