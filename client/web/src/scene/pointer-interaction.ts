// Pointer interaction in the scene: highlighting links, selecting robots, and pulling on links.
import { Matrix4, Plane, Quaternion, Vector2, Vector3 } from "three";
import { pullLink, stopPulling } from "../daemon/actions";
import type { Vector } from "../state/scene";
import { fit, hoveredLink, selectedRobot } from "../state/view";
import { robots as known, simulation, frame as newestFrame, type Frame, type Mode } from "../state/world";
import type { Camera } from "./camera";
import type { PoseInterpolator } from "./pose-interpolator";
import { PULL } from "./palette";
import { pick, pickRay, type Hit } from "./picking";
import type { RobotViews } from "./robot-views";
import { Rod } from "./rods";
import { springFor, springForce } from "./spring";

/** A pointer that moves by fewer pixels has clicked. */
const CLICK_DISTANCE = 4;
/** Of the rod, as a fraction of the distance of the camera. */
const ROD_WIDTH = 0.0022;
/** Bounds of the measured delay, simulated seconds. */
const MIN_DELAY = 0.03;
const MAX_DELAY = 1;
/** Weight of a new measurement that is shorter than the delay so far. */
const SMOOTHING = 0.2;

/** A link that is being dragged. */
interface Drag {
  hit: Hit;
  /** In the link's frame, metres. */
  point: Vector3;
  /** The plane through the point, parallel to the picture, in which the pointer moves. */
  plane: Plane;
}

/** Handles pointer events until it is disposed of. */
export class PointerInteraction {
  /** From the dragged point to the pointer. */
  readonly rod = new Rod(PULL);
  private readonly pointer = new Vector2();
  private pressed: { x: number; y: number } | null = null;
  private drag: Drag | null = null;
  private hoverPending = false;
  /** Simulated seconds. */
  private delay = MIN_DELAY;
  /** Simulated time of the last state for which a force was sent. */
  private lastForceAt = 0;
  private readonly listening = new AbortController();

  /** `wake` is called when the picture may have to change. */
  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly camera: Camera,
    private readonly robots: RobotViews,
    private readonly interpolator: PoseInterpolator,
    private readonly wake: () => void,
  ) {
    const { signal } = this.listening;
    // Capturing, so that a drag of a link does not orbit the camera.
    canvas.addEventListener("pointerdown", (event) => this.press(event), { signal, capture: true });
    canvas.addEventListener("pointermove", (event) => this.move(event), { signal });
    canvas.addEventListener("pointerup", (event) => this.release(event), { signal });
    canvas.addEventListener("pointercancel", () => this.endDrag(), { signal });
    canvas.addEventListener("pointerleave", () => this.leave(), { signal });
    canvas.addEventListener("dblclick", (event) => this.fitAt(event), { signal });
    window.addEventListener("blur", () => this.endDrag(), { signal });
  }

  /** Called for each frame. Returns whether the picture changes, in which case the next frame is needed too. */
  update(): boolean {
    if (this.hoverPending) this.updateHover();
    if (!this.drag) return false;
    if (simulation.peek().state !== "playing" || this.robots.get(this.drag.hit.view.scene.robot) !== this.drag.hit.view) {
      this.endDrag();
      return true;
    }
    this.pull(this.drag);
    return true;
  }

  dispose(): void {
    this.endDrag();
    this.listening.abort();
    this.rod.dispose();
  }

  private press(event: PointerEvent): void {
    this.trackPointer(event);
    this.pressed = { x: event.clientX, y: event.clientY };
    if (event.button !== 0 || !event.isPrimary || simulation.peek().state !== "playing") return;
    const hit = pick(this.pointer, this.camera.camera, this.robots.all());
    if (!hit?.view.scene.links[hit.link]?.movable) return;
    this.camera.controls.enabled = false;
    this.canvas.setPointerCapture(event.pointerId);
    const facing = this.camera.camera.getWorldDirection(new Vector3());
    this.delay = MIN_DELAY;
    this.lastForceAt = this.interpolator.newest()?.simTime ?? 0;
    this.drag = {
      hit,
      point: hit.point.clone().applyMatrix4(new Matrix4().copy(hit.view.worldFromLink(hit.link)).invert()),
      plane: new Plane().setFromNormalAndCoplanarPoint(facing, hit.point),
    };
    this.canvas.style.cursor = "grabbing";
    this.wake();
  }

  private move(event: PointerEvent): void {
    this.trackPointer(event);
    if (event.buttons === 0 && event.pointerType === "mouse") this.hoverPending = true;
    if (this.drag || this.hoverPending) this.wake();
  }

  private release(event: PointerEvent): void {
    this.trackPointer(event);
    const { pressed } = this;
    this.pressed = null;
    this.endDrag();
    if (!pressed || event.button !== 0) return;
    if (Math.hypot(event.clientX - pressed.x, event.clientY - pressed.y) > CLICK_DISTANCE) return;
    const hit = pick(this.pointer, this.camera.camera, this.robots.all());
    // The ground is not selected.
    if (hit?.view.scene.links.some((link) => link.movable)) selectedRobot.value = hit.view.scene.robot;
  }

  private leave(): void {
    this.hoverPending = false;
    if (!this.drag) hoveredLink.value = null;
  }

  private fitAt(event: MouseEvent): void {
    this.trackPointer(event);
    const hit = pick(this.pointer, this.camera.camera, this.robots.all());
    const movable = hit?.view.scene.links.some((link) => link.movable) ?? false;
    fit(hit && movable ? hit.view.scene.robot : "");
  }

  private endDrag(): void {
    this.camera.controls.enabled = true;
    if (!this.drag) return;
    const { view, link } = this.drag.hit;
    void stopPulling(view.scene.robot, view.scene.links[link]?.name ?? "");
    this.drag = null;
    this.rod.hide();
    this.canvas.style.cursor = "";
    this.wake();
  }

  /** Takes the position of the pointer, from -1 to 1. */
  private trackPointer(event: MouseEvent): void {
    const box = this.canvas.getBoundingClientRect();
    this.pointer.set((2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height);
  }

  private updateHover(): void {
    this.hoverPending = false;
    const hit = pick(this.pointer, this.camera.camera, this.robots.all());
    const link = hit?.view.scene.links[hit.link];
    const found = hit && link?.movable ? { robot: hit.view.scene.robot, link: link.name } : null;
    const before = hoveredLink.peek();
    if (found?.robot === before?.robot && found?.link === before?.link) return;
    hoveredLink.value = found;
    this.canvas.style.cursor = found && simulation.peek().state === "playing" ? "grab" : "";
  }

  private pull({ hit, point, plane }: Drag): void {
    const { scene } = hit.view;
    const target = pickRay(this.pointer, this.camera.camera).ray.intersectPlane(plane, new Vector3());
    const newest = this.interpolator.newest();
    const now = newest && positionOf(newest, scene.robot, hit.link, point);
    if (!target || !now) return;
    this.measureDelay(newest.simTime);
    const spring = springFor(scene, hit.link, (link) => modeOf(scene.robot, link), this.delay);
    const force = springForce(spring, now, this.velocity(scene.robot, hit.link, point), target.toArray());
    void pullLink(scene.robot, scene.links[hit.link]?.name ?? "", force, point.toArray());
    const shown = point.clone().applyMatrix4(hit.view.worldFromLink(hit.link));
    this.rod.show(shown, target, ROD_WIDTH * this.camera.distance());
  }

  /** The delay from a state to the end of the force for it, which lasts until the force for the next state. */
  private measureDelay(simTime: number): void {
    const interval = simTime - this.lastForceAt;
    if (interval <= 0) return;
    this.lastForceAt = simTime;
    const measured = Math.min(MAX_DELAY, Math.max(MIN_DELAY, 2 * interval));
    // A longer delay takes effect at once, a shorter one gradually.
    this.delay = Math.max(measured, this.delay + SMOOTHING * (measured - this.delay));
  }

  /** The velocity of a point of a link, from the last two states: metres per simulated second. */
  private velocity(robot: string, link: number, point: Vector3): Vector {
    const two = this.interpolator.lastTwo();
    if (!two) return [0, 0, 0];
    const [before, last] = two;
    const from = positionOf(before, robot, link, point);
    const to = positionOf(last, robot, link, point);
    const time = last.simTime - before.simTime;
    if (!from || !to || time <= 0) return [0, 0, 0];
    return [(to[0] - from[0]) / time, (to[1] - from[1]) / time, (to[2] - from[2]) / time];
  }
}

/** The position of a point of a link in a state, in world axes. */
function positionOf(frame: Frame, robot: string, link: number, point: Vector3): Vector | undefined {
  const pose = frame.poses.get(robot)?.subarray(7 * link, 7 * link + 7);
  if (pose?.length !== 7) return undefined;
  const [x = 0, y = 0, z = 0, qx = 0, qy = 0, qz = 0, qw = 1] = pose;
  const turned = point.clone().applyQuaternion(new Quaternion(qx, qy, qz, qw));
  return [x + turned.x, y + turned.y, z + turned.z];
}

/** The mode of the joint that moves a link; undefined if it cannot move. */
function modeOf(robot: string, link: string): Mode | undefined {
  const axis = known.peek().find((each) => each.name === robot)?.axes.find((each) => each.childLink === link);
  return axis && frameMode(robot, axis.velocityIndex);
}

function frameMode(robot: string, index: number): Mode | undefined {
  return newestFrame.peek()?.joints.get(robot)?.mode[index];
}
