// What the pointer does in the scene: it lights up links, chooses robots, and pulls.
import { Matrix4, Plane, Quaternion, Vector2, Vector3 } from "three";
import { pushLink, stopPushing } from "../daemon/actions";
import type { Vector } from "../state/scene";
import { fit, hoveredLink, selectedRobot } from "../state/view";
import { robots as known, simulation, frame as newestFrame, type Frame, type Mode } from "../state/world";
import type { Camera } from "./camera";
import type { Motion } from "./motion";
import { PULL } from "./palette";
import { pick, sightLine, type Hit } from "./pointer";
import type { Robots } from "./robots";
import { Rod } from "./rods";
import { pull, springFor } from "./spring";

/** Pixels that a hand trembles by when it clicks. */
const TREMBLE = 4;
/** Of the rod, as a part of the distance that it is seen from. */
const ROD_WIDTH = 0.0022;
/** Simulated seconds: what a delay is taken for, whatever was measured. */
const QUICKEST = 0.03;
const SLOWEST = 1;
/** Share of each new measurement that is shorter. */
const SMOOTHING = 0.2;

/** A link that is held. */
interface Grip {
  hit: Hit;
  /** In the link's frame, metres. */
  point: Vector3;
  /** Through the point, parallel to the picture: in it the pointer pulls. */
  plane: Plane;
}

/** Listens to the pointer until it is disposed of. */
export class Hands {
  /** From the point that is held to the pointer. */
  readonly rod = new Rod(PULL);
  private readonly at = new Vector2();
  private pressed: { x: number; y: number } | null = null;
  private grip: Grip | null = null;
  private searching = false;
  /** Simulated seconds. */
  private delay = QUICKEST;
  /** Simulated time of the state that was last answered with a force. */
  private answered = 0;
  private readonly listening = new AbortController();

  /** `wake` is called when the picture may have to change. */
  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly camera: Camera,
    private readonly robots: Robots,
    private readonly motion: Motion,
    private readonly wake: () => void,
  ) {
    const { signal } = this.listening;
    // Before the controls of the camera see it: what is pulled does not orbit.
    canvas.addEventListener("pointerdown", (event) => this.press(event), { signal, capture: true });
    canvas.addEventListener("pointermove", (event) => this.move(event), { signal });
    canvas.addEventListener("pointerup", (event) => this.release(event), { signal });
    canvas.addEventListener("pointercancel", () => this.letGo(), { signal });
    canvas.addEventListener("pointerleave", () => this.leave(), { signal });
    canvas.addEventListener("dblclick", (event) => this.fitAt(event), { signal });
    window.addEventListener("blur", () => this.letGo(), { signal });
  }

  /** Does what is due for this picture. Answers whether it changes, and the next is due too. */
  update(): boolean {
    if (this.searching) this.search();
    if (!this.grip) return false;
    if (simulation.peek().state !== "playing" || this.robots.get(this.grip.hit.view.scene.robot) !== this.grip.hit.view) {
      this.letGo();
      return true;
    }
    this.pullOn(this.grip);
    return true;
  }

  dispose(): void {
    this.letGo();
    this.listening.abort();
    this.rod.dispose();
  }

  private press(event: PointerEvent): void {
    this.aim(event);
    this.pressed = { x: event.clientX, y: event.clientY };
    if (event.button !== 0 || !event.isPrimary || simulation.peek().state !== "playing") return;
    const hit = pick(this.at, this.camera.camera, this.robots.all());
    if (!hit?.view.scene.links[hit.link]?.movable) return;
    this.camera.controls.enabled = false;
    this.canvas.setPointerCapture(event.pointerId);
    const facing = this.camera.camera.getWorldDirection(new Vector3());
    this.delay = QUICKEST;
    this.answered = this.motion.newest()?.simTime ?? 0;
    this.grip = {
      hit,
      point: hit.point.clone().applyMatrix4(new Matrix4().copy(hit.view.worldFromLink(hit.link)).invert()),
      plane: new Plane().setFromNormalAndCoplanarPoint(facing, hit.point),
    };
    this.canvas.style.cursor = "grabbing";
    this.wake();
  }

  private move(event: PointerEvent): void {
    this.aim(event);
    if (event.buttons === 0 && event.pointerType === "mouse") this.searching = true;
    if (this.grip || this.searching) this.wake();
  }

  private release(event: PointerEvent): void {
    this.aim(event);
    const { pressed } = this;
    this.pressed = null;
    this.letGo();
    if (!pressed || event.button !== 0) return;
    if (Math.hypot(event.clientX - pressed.x, event.clientY - pressed.y) > TREMBLE) return;
    const hit = pick(this.at, this.camera.camera, this.robots.all());
    // The ground is no robot that one would choose.
    if (hit?.view.scene.links.some((link) => link.movable)) selectedRobot.value = hit.view.scene.robot;
  }

  private leave(): void {
    this.searching = false;
    if (!this.grip) hoveredLink.value = null;
  }

  private fitAt(event: MouseEvent): void {
    this.aim(event);
    const hit = pick(this.at, this.camera.camera, this.robots.all());
    const movable = hit?.view.scene.links.some((link) => link.movable) ?? false;
    fit(hit && movable ? hit.view.scene.robot : "");
  }

  private letGo(): void {
    this.camera.controls.enabled = true;
    if (!this.grip) return;
    const { view, link } = this.grip.hit;
    void stopPushing(view.scene.robot, view.scene.links[link]?.name ?? "");
    this.grip = null;
    this.rod.hide();
    this.canvas.style.cursor = "";
    this.wake();
  }

  /** Where the pointer is, from -1 to 1. */
  private aim(event: MouseEvent): void {
    const box = this.canvas.getBoundingClientRect();
    this.at.set((2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height);
  }

  private search(): void {
    this.searching = false;
    const hit = pick(this.at, this.camera.camera, this.robots.all());
    const link = hit?.view.scene.links[hit.link];
    const found = hit && link?.movable ? { robot: hit.view.scene.robot, link: link.name } : null;
    const before = hoveredLink.peek();
    if (found?.robot === before?.robot && found?.link === before?.link) return;
    hoveredLink.value = found;
    this.canvas.style.cursor = found && simulation.peek().state === "playing" ? "grab" : "";
  }

  private pullOn({ hit, point, plane }: Grip): void {
    const { scene } = hit.view;
    const target = sightLine(this.at, this.camera.camera).ray.intersectPlane(plane, new Vector3());
    const newest = this.motion.newest();
    const now = newest && placeOf(newest, scene.robot, hit.link, point);
    if (!target || !now) return;
    this.measureDelay(newest.simTime);
    const spring = springFor(scene, hit.link, (link) => modeOf(scene.robot, link), this.delay);
    const force = pull(spring, now, this.velocity(scene.robot, hit.link, point), target.toArray());
    void pushLink(scene.robot, scene.links[hit.link]?.name ?? "", force, point.toArray());
    const shown = point.clone().applyMatrix4(hit.view.worldFromLink(hit.link));
    this.rod.show(shown, target, ROD_WIDTH * this.camera.distance());
  }

  /** From a state to the end of the force that answers it: it came, and lasts until the next state is answered. */
  private measureDelay(simTime: number): void {
    const interval = simTime - this.answered;
    if (interval <= 0) return;
    this.answered = simTime;
    const measured = Math.min(SLOWEST, Math.max(QUICKEST, 2 * interval));
    // Softer at once, stiffer by and by.
    this.delay = Math.max(measured, this.delay + SMOOTHING * (measured - this.delay));
  }

  /** Metres per simulated second, of a point of a link, by the last two states. */
  private velocity(robot: string, link: number, point: Vector3): Vector {
    const two = this.motion.lastTwo();
    if (!two) return [0, 0, 0];
    const [before, last] = two;
    const from = placeOf(before, robot, link, point);
    const to = placeOf(last, robot, link, point);
    const time = last.simTime - before.simTime;
    if (!from || !to || time <= 0) return [0, 0, 0];
    return [(to[0] - from[0]) / time, (to[1] - from[1]) / time, (to[2] - from[2]) / time];
  }
}

/** Where a point of a link is in a state, in world axes. */
function placeOf(frame: Frame, robot: string, link: number, point: Vector3): Vector | undefined {
  const pose = frame.poses.get(robot)?.subarray(7 * link, 7 * link + 7);
  if (pose?.length !== 7) return undefined;
  const [x = 0, y = 0, z = 0, qx = 0, qy = 0, qz = 0, qw = 1] = pose;
  const turned = point.clone().applyQuaternion(new Quaternion(qx, qy, qz, qw));
  return [x + turned.x, y + turned.y, z + turned.z];
}

/** What the joint does that moves a link; nothing where it cannot move. */
function modeOf(robot: string, link: string): Mode | undefined {
  const axis = known.peek().find((each) => each.name === robot)?.axes.find((each) => each.childLink === link);
  return axis && frameMode(robot, axis.velocityIndex);
}

function frameMode(robot: string, index: number): Mode | undefined {
  return newestFrame.peek()?.joints.get(robot)?.mode[index];
}
