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
  /** The position of a point of the world, in metres, on the page, in CSS pixels. */
  project(point: readonly [number, number, number]): { x: number; y: number };
  /** The newest state. */
  frame(): Frame | null;
  /** The sequence of the newest state that is drawn. */
  drawn(): bigint;
  /** Whether nothing is pending: all meshes are loaded, and the newest state is drawn. */
  settled(): boolean;
  /** Moves the camera, or returns where it is: metres. */
  camera: {
    position(): [number, number, number];
    target(): [number, number, number];
    look(position: readonly [number, number, number], target: readonly [number, number, number]): void;
    fit(robot?: string): void;
  };
  /** The recording that is shown, at the state that is drawn. */
  recording: {
    /** Null if there is none. */
    state(): { number: number; simTime: number; joints: Record<string, { name: string[]; position: number[] }> } | null;
    /** world_from_link of a robot of the recording, as it is drawn: x y z, then the quaternion x y z w. */
    pose(robot: string, link: string): number[] | undefined;
  };
  /** Where the centre of mass of a robot is marked, world axes; undefined if it is not. */
  centreOfMass(robot: string): number[] | undefined;
  /** How many points that sensors have met are drawn. */
  points(): number;
  /** How many pictures of cameras are drawn in the scene. */
  cameraPictures(): number;
  /** Where the ends of a constraint are drawn, world axes; undefined if it is not. */
  constraint(name: string): [number[], number[]] | undefined;
  /** Points of a marker as they are drawn, world axes; undefined if it is not. */
  marker(id: bigint): number[][] | undefined;
  /** Whether the pointer is on a handle, or drags one. */
  handle(): boolean;
  /** How fine the picture is. */
  quality(): "low" | "high";
  /** Whether gaps and edges are darkened. */
  occlusion(): boolean;
  stats: {
    /** Since the page was loaded. */
    pictures(): number;
    requests(): number;
    /** States that arrived. */
    frames(): number;
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
    stats: { pictures: () => stage.pictures, requests: requestCount, frames: () => frames },
  };
  return frame.subscribe(() => {
    frames += 1;
  });
}
