// The handles: three's transform controls on a robot's root, the end of an arm, or a joint.
import { Object3D, Quaternion, Vector3 } from "three";
import { TransformControls } from "three/examples/jsm/controls/TransformControls.js";
import { Throttle } from "../daemon/throttle";
import type { Pose, RobotScene } from "../state/scene";
import { handleHeld, type Placing } from "../state/tools";
import { making } from "../state/undo";
import type { HandleScene } from "../scene/handles";
import { placed, type Placement } from "./placement";

/** Minimum milliseconds between two calls during a drag. */
const INTERVAL = 50;
const Z = new Vector3(0, 0, 1);

/** One set of handles until it is disposed of. */
export class Gizmo {
  private readonly controls: TransformControls;
  /** Pose of the handles: world_from_link, for a joint turned such that its z is the joint's axis. */
  private readonly held = new Object3D();
  private wanted: Placing | null = null;
  /** Placement that the current drag changes, and its pose at the start. */
  private drag: { placement: Placement; from: Pose } | null = null;
  private readonly calls = new Throttle(INTERVAL);

  constructor(private readonly at: HandleScene) {
    this.controls = new TransformControls(at.camera.camera, at.canvas);
    this.controls.setSpace("world");
    at.scene.add(this.held, this.controls.getHelper());
    this.controls.addEventListener("change", at.changed);
    this.controls.addEventListener("dragging-changed", ({ value }) => this.dragged(value === true));
    this.controls.addEventListener("axis-changed", ({ value }) => {
      handleHeld.value = value !== null || this.drag !== null;
    });
    this.controls.addEventListener("objectChange", () => this.move());
  }

  /** Attaches the handles; null detaches them. */
  place(wanted: Placing | null, mode: "translate" | "rotate"): void {
    this.wanted = wanted;
    const joint = wanted?.joint === undefined ? undefined : this.sceneOf(wanted.robot)?.joints?.find(({ name }) => name === wanted.joint);
    const turns = joint ? joint.type !== "prismatic" : mode === "rotate";
    this.controls.setMode(turns ? "rotate" : "translate");
    // A joint has one handle, along or about its axis.
    this.controls.setSpace(joint ? "local" : "world");
    this.controls.showX = this.controls.showY = !joint;
    if (wanted) this.controls.attach(this.held);
    else this.controls.detach();
    if (!wanted) handleHeld.value = false;
    this.update();
  }

  /** Follows the attached object, except during a drag. */
  update(): void {
    const { wanted } = this;
    if (!wanted || this.drag) return;
    const pose = this.drawnPose(wanted);
    const helper = this.controls.getHelper();
    helper.visible = pose !== undefined;
    this.controls.enabled = pose !== undefined;
    if (!pose) return;
    const [x, y, z, qx, qy, qz, qw] = pose;
    this.held.position.set(x, y, z);
    this.held.quaternion.set(qx, qy, qz, qw);
    this.held.updateMatrixWorld();
  }

  dispose(): void {
    handleHeld.value = false;
    this.calls.end();
    this.controls.detach();
    this.controls.getHelper().removeFromParent();
    this.held.removeFromParent();
    this.controls.dispose();
  }

  private dragged(on: boolean): void {
    this.at.camera.controls.enabled = !on;
    handleHeld.value = on;
    if (on && this.wanted) {
      this.drag = { placement: placed(this.wanted), from: this.pose() };
      return;
    }
    const { drag } = this;
    this.drag = null;
    const to = this.pose();
    if (drag) void making(this.calls.finish(() => drag.placement.end(drag.from, to)));
    this.at.changed();
  }

  private move(): void {
    const { drag } = this;
    if (!drag) return;
    const to = this.pose();
    void this.calls.next(() => drag.placement.to(to, drag.from));
  }

  private pose(): Pose {
    const { position: p, quaternion: q } = this.held;
    return [p.x, p.y, p.z, q.x, q.y, q.z, q.w];
  }

  private sceneOf(robot: string): RobotScene | undefined {
    return this.at.robots.get(robot)?.scene;
  }

  /** Returns the drawn pose of the object. */
  private drawnPose({ robot, link, joint }: Placing): Pose | undefined {
    const view = this.at.robots.get(robot);
    const found = joint === undefined ? undefined : view?.scene.joints?.find(({ name }) => name === joint);
    const name = found?.child ?? link;
    const index = name === undefined ? 0 : (view?.scene.links.findIndex((each) => each.name === name) ?? -1);
    const [x, y, z, qx, qy, qz, qw] = view?.drawnPose(index) ?? [];
    if (x === undefined || y === undefined || z === undefined || qx === undefined || qy === undefined || qz === undefined || qw === undefined) return undefined;
    const turn = new Quaternion(qx, qy, qz, qw);
    if (found?.axis) turn.multiply(new Quaternion().setFromUnitVectors(Z, new Vector3(...found.axis)));
    return [x, y, z, turn.x, turn.y, turn.z, turn.w];
  }
}
