// Every change that people make to the world. Each answers once it holds; refusals become toasts.
import type { Axis, Mode } from "../state/world";

/** A dropped file and where in the dropped folder it was. */
export interface DroppedFile {
  path: string;
  file: File;
}

/** Gives an axis a target. Newest wins per axis; one call is in flight, and takes all that wait. */
export async function setTarget(_axis: Axis, _mode: Mode, _value: number): Promise<void> {}
/** Lets all joints of a robot hold where they are. */
export async function holdAll(_robot: string): Promise<void> {}
/** Takes the actuators of a robot away. */
export async function freeAll(_robot: string): Promise<void> {}
export async function play(): Promise<void> {}
export async function pause(): Promise<void> {}
/** Does `n` steps; pauses first where the world plays. */
export async function step(_n: number): Promise<void> {}
/** Puts time and robots back to the start. */
export async function reset(): Promise<void> {}
/** Real-time factor; Infinity is as fast as possible. */
export async function setSpeed(_factor: number): Promise<void> {}
export async function setParameter(_name: string, _value: number): Promise<void> {}
export async function pressButton(_name: string): Promise<void> {}
export async function deleteRobot(_name: string): Promise<void> {}
/** Loads the robots that the files describe. */
export async function loadFiles(_files: DroppedFile[]): Promise<void> {}
/** Pushes a link: newtons in world axes, at a point in the link's frame. Lasts 0.2 simulated seconds. */
export async function pushLink(
  _robot: string,
  _link: string,
  _force: readonly [number, number, number],
  _pointInLink: readonly [number, number, number],
): Promise<void> {}
export async function stopPushing(_robot: string, _link: string): Promise<void> {}
