// Pointer interaction in the scene: highlighting links, selecting robots, and pulling on links.
import { Matrix4, Plane, Vector2, Vector3 } from "three";
import { pullLink, stopPulling } from "../daemon/actions";
import { handleHeld } from "../state/tools";
import { fit, hoveredLink, selectedRobot } from "../state/view";
import { robots as known, simulation, frame as newestFrame, type Mode } from "../state/world";
import type { Camera } from "./camera";
import { PULL } from "./palette";
import { pick, pickRay, type Hit } from "./picking";
import type { RobotViews } from "./robot-views";
import { Rod } from "./rods";
import { pullDuration, springFor } from "./spring";

/** A pointer that moves by fewer pixels clicks. */
const CLICK_DISTANCE = 4;
/** Width of the rod, as a fraction of the camera's distance. */
const ROD_WIDTH = 0.0022;
/** Milliseconds after which an unchanged target is sent again. */
const RENEWAL = 100;

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
  /** Vector from the dragged point to the pointer. */
  readonly rod = new Rod(PULL);
  private readonly pointer = new Vector2();
  private pressed: { x: number; y: number } | null = null;
  private drag: Drag | null = null;
  private hoverPending = false;
  /** Time of the last sent target, and its value. */
  private sent: { at: number; target: Vector3 } | null = null;
  private readonly listening = new AbortController();

  /** `wake` is called if the picture may have to change. */
  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly camera: Camera,
    private readonly robots: RobotViews,
    private readonly wake: () => void,
  ) {
    const { signal } = this.listening;
    // Captures events, so that a drag of a link does not orbit the camera.
    canvas.addEventListener("pointerdown", (event) => this.press(event), { signal, capture: true });
    canvas.addEventListener("pointermove", (event) => this.move(event), { signal });
    canvas.addEventListener("pointerup", (event) => this.release(event), { signal });
    canvas.addEventListener("pointercancel", () => this.endDrag(), { signal });
    canvas.addEventListener("pointerleave", () => this.leave(), { signal });
    canvas.addEventListener("dblclick", (event) => this.fitAt(event), { signal });
    window.addEventListener("blur", () => this.endDrag(), { signal });
  }

  /** Called for each frame. Returns whether the picture changes, so that the next frame is needed too. */
  update(): boolean {
    if (this.hoverPending) this.updateHover();
    if (!this.drag) return false;
    if (handleHeld.peek() || simulation.peek().state !== "playing" || this.robots.get(this.drag.hit.view.scene.robot) !== this.drag.hit.view) {
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
    if (event.button !== 0 || !event.isPrimary || handleHeld.peek() || simulation.peek().state !== "playing") return;
    const hit = pick(this.pointer, this.camera.camera, this.robots.all());
    if (!hit?.view.scene.links[hit.link]?.movable) return;
    this.camera.controls.enabled = false;
    this.canvas.setPointerCapture(event.pointerId);
    const facing = this.camera.camera.getWorldDirection(new Vector3());
    this.sent = null;
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

  /**
   * Sends the position to which the pointer pulls. The daemon computes the force: the page's frame rate does
   * not matter.
   */
  private pull({ hit, point, plane }: Drag): void {
    const { scene } = hit.view;
    const target = pickRay(this.pointer, this.camera.camera).ray.intersectPlane(plane, new Vector3());
    if (!target) return;
    const now = performance.now();
    if (!this.sent || now - this.sent.at > RENEWAL || !this.sent.target.equals(target)) {
      const duration = pullDuration(this.sent ? now - this.sent.at : 0, simulation.peek().actual);
      this.sent = { at: now, target };
      const spring = springFor(scene, hit.link, (link) => modeOf(scene.robot, link));
      void pullLink(scene.robot, scene.links[hit.link]?.name ?? "", point.toArray(), target.toArray(), spring, duration);
    }
    const shown = point.clone().applyMatrix4(hit.view.worldFromLink(hit.link));
    this.rod.show(shown, target, ROD_WIDTH * this.camera.distance());
  }
}

/** Returns the mode of the joint that moves a link; undefined if it cannot move. */
function modeOf(robot: string, link: string): Mode | undefined {
  const axis = known.peek().find((each) => each.name === robot)?.axes.find((each) => each.childLink === link);
  return axis && frameMode(robot, axis.velocityIndex);
}

function frameMode(robot: string, index: number): Mode | undefined {
  return newestFrame.peek()?.joints.get(robot)?.mode[index];
}
