// The interface of the page for tests and scripts: `window.simd`.
import { Vector3 } from "three";
import { requestCount } from "../daemon/request-count";
import { playback } from "../state/playback";
import { handleHeld } from "../state/tools";
import { fit } from "../state/view";
import { frame, type Frame } from "../state/world";
import type { Stage } from "./stage";

/** `window.simd`. */
export interface Hook {
  /** Returns the position of a point of the world, in metres, on the page, in CSS pixels. */
  project(point: readonly [number, number, number]): { x: number; y: number };
  /** The newest state. */
  frame(): Frame | null;
  /** The sequence of the newest drawn state. */
  drawn(): bigint;
  /** Whether nothing is pending: all meshes are loaded, and the newest state is drawn. */
  settled(): boolean;
  /** Moves the camera, or returns its position: metres. */
  camera: {
    position(): [number, number, number];
    target(): [number, number, number];
    look(position: readonly [number, number, number], target: readonly [number, number, number]): void;
    fit(robot?: string): void;
  };
  /** The shown recording, at the drawn state. */
  recording: {
    /** Null without one. */
    state(): { number: number; simTime: number; joints: Record<string, { name: string[]; position: number[] }> } | null;
    /** Returns world_from_link of a robot of the recording, as drawn: x y z, then the quaternion x y z w. */
    pose(robot: string, link: string): number[] | undefined;
  };
  /** Returns the marked centre of mass of a robot, world axes; undefined if it is not marked. */
  centreOfMass(robot: string): number[] | undefined;
  /** Number of drawn points of sensors. */
  points(): number;
  /** Number of cameras' pictures that are drawn in the scene. */
  cameraPictures(): number;
  /** Returns the drawn ends of a constraint, world axes; undefined if it is not drawn. */
  constraint(name: string): [number[], number[]] | undefined;
  /** Returns the drawn points of a marker, world axes; undefined if it is not drawn. */
  marker(id: bigint): number[][] | undefined;
  /** Whether the pointer is on a handle, or drags one. */
  handle(): boolean;
  /** Quality of the picture. */
  quality(): "low" | "high";
  /** Whether ambient occlusion is drawn. */
  occlusion(): boolean;
  stats: {
    /** Counts since the page was loaded. */
    pictures(): number;
    requests(): number;
    /** Number of received states. */
    frames(): number;
    /** Number of calls that drew the last picture. */
    calls(): number;
  };
}

declare global {
  interface Window {
    simd: Hook;
  }
}

/** Installs the interface for a stage. Returns a function that ends its counts. */
export function hook(stage: Stage, canvas: HTMLCanvasElement): () => void {
  let frames = 0;
  const { camera, controls } = stage.camera;
  window.simd = {
    project(point) {
      camera.updateMatrixWorld();
      const at = new Vector3(...point).project(camera);
      const box = canvas.getBoundingClientRect();
      return { x: box.left + ((at.x + 1) / 2) * box.width, y: box.top + ((1 - at.y) / 2) * box.height };
    },
    frame: () => frame.peek(),
    drawn: () => stage.drawn,
    settled: () => stage.isSettled(),
    camera: {
      position: () => camera.position.toArray(),
      target: () => controls.target.toArray(),
      look(position, target) {
        stage.camera.movedByUser = true;
        camera.position.set(...position);
        controls.target.set(...target);
        stage.invalidate();
      },
      fit: (robot = "") => fit(robot),
    },
    recording: {
      state() {
        const shown = playback.peek()?.player.shown.peek();
        return shown ? { number: shown.number, simTime: shown.simTime, joints: Object.fromEntries(shown.joints) } : null;
      },
      pose: (robot, link) => stage.ghosts.pose(robot, link),
    },
    centreOfMass: (robot) => stage.structure.centres.get(robot)?.toArray(),
    points: () => stage.extras.points.count(),
    cameraPictures: () => stage.extras.pictures.count(),
    constraint(name) {
      const ends = stage.constraints.group.visible ? stage.constraints.anchors.get(name) : undefined;
      return ends && [ends[0].toArray(), ends[1].toArray()];
    },
    marker: (id) => stage.markers.points(id),
    handle: () => handleHeld.peek(),
    quality: () => stage.appearance.quality,
    occlusion: () => stage.appearance.hasOcclusion,
    stats: { pictures: () => stage.pictures, requests: requestCount, frames: () => frames, calls: () => stage.calls },
  };
  return frame.subscribe(() => {
    frames += 1;
  });
}
