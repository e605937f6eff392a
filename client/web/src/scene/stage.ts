// The picture: drawn when something in it has changed, and not otherwise.
import { effect } from "@preact/signals";
import { Color, Fog, PCFShadowMap, Scene, Sphere, WebGLRenderer } from "three";
import { lift } from "../daemon/actions";
import { unmeasured } from "../state/report";
import { scenes } from "../state/scene";
import { collisions, contacts, fitRequest, frames, grid, hoveredLink, visuals } from "../state/view";
import { connection, frame, type Frame } from "../state/world";
import { shownTheme } from "../style/theme";
import { Camera } from "./camera";
import { ContactMarks } from "./contacts";
import { Ground } from "./ground";
import { Hands } from "./hands";
import { Light } from "./light";
import { Motion } from "./motion";
import { PALETTES } from "./palette";
import { Robots } from "./robots";

/** More pixels than this for one of CSS cost more than they show. */
const SHARPEST = 2;
/** Milliseconds after which the shadow follows those who walked away. */
const SHADOW_INTERVAL = 500;
const GRAVITY = 9.81;
/** Metres that a foot may be below the ground. */
const SUNK = 1e-3;

/** What is drawn on one canvas. */
export class Stage {
  readonly camera: Camera;
  readonly motion = new Motion();
  readonly robots: Robots;
  /** Pictures drawn so far. */
  pictures = 0;
  /** The newest state that was drawn. */
  drawn = 0n;
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly fog = new Fog(0);
  private readonly ground = new Ground(this.scene);
  private readonly light = new Light(this.scene);
  private readonly marks = new ContactMarks();
  private readonly hands: Hands;
  private readonly ends: (() => void)[] = [];
  private request = 0;
  private dirty = true;
  private covered = 0;
  /** A robot or a mesh came that nobody has looked at yet. */
  private unseen = false;

  /** Throws where the browser cannot draw. */
  constructor(canvas: HTMLCanvasElement) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, powerPreference: "low-power" });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    this.robots = new Robots(() => this.grown());
    this.scene.fog = this.fog;
    this.scene.add(this.robots.group, this.marks.group);
    this.camera = new Camera(canvas, () => this.invalidate());
    this.hands = new Hands(canvas, this.camera, this.robots, this.motion, () => this.wake());
    this.scene.add(this.hands.rod.group);
    this.follow();
  }

  /** Draws again, soon. */
  invalidate(): void {
    this.dirty = true;
    this.wake();
  }

  /** Nothing is on its way any more: what is seen is what there is. */
  isSettled(): boolean {
    const still = this.camera.isStill() && this.motion.isSettled(performance.now());
    const complete = this.motion.newest() !== null && this.robots.meshes.isComplete() && !this.unseen;
    return this.pictures > 0 && !this.dirty && still && complete;
  }

  resize(width: number, height: number): void {
    this.renderer.setPixelRatio(Math.min(SHARPEST, devicePixelRatio));
    this.renderer.setSize(width, height, false);
    this.camera.resize(width, height);
    this.invalidate();
    // At once: else the old picture is stretched until the next.
    if (this.pictures > 0) this.draw(performance.now());
  }

  dispose(): void {
    cancelAnimationFrame(this.request);
    for (const end of this.ends) end();
    this.hands.dispose();
    this.robots.dispose();
    this.marks.dispose();
    this.ground.dispose();
    this.light.dispose();
    this.camera.dispose();
    this.renderer.dispose();
  }

  /** Looks whether there is something to draw, soon. */
  private wake(): void {
    if (this.request === 0) this.request = requestAnimationFrame((now) => this.tick(now));
  }

  /** Draws what the state of the page says. */
  private follow(): void {
    this.ends.push(
      effect(() => {
        this.robots.keep(scenes.value);
        this.grown();
      }),
      effect(() => {
        if (frame.value) this.take(frame.value);
      }),
      effect(() => {
        this.robots.show({ visuals: visuals.value, collisions: collisions.value, frames: frames.value });
        this.invalidate();
      }),
      effect(() => {
        scenes.value;
        this.ground.show(grid.value, !this.robots.hasPlane());
        this.marks.group.visible = contacts.value;
        this.invalidate();
      }),
      effect(() => {
        scenes.value;
        if (this.robots.highlight(hoveredLink.value)) this.invalidate();
      }),
      effect(() => {
        if (connection.value.state === "lost") this.wake();
      }),
      effect(() => {
        const palette = PALETTES[shownTheme.value];
        this.scene.background = new Color(palette.background);
        this.fog.color.set(palette.background);
        this.robots.paints.ground.color.set(palette.ground);
        this.ground.paint(palette);
        this.light.paint(palette);
        this.invalidate();
      }),
      fitRequest.subscribe(({ robot, count }) => {
        if (count === 0) return;
        this.camera.fit(this.robots.bounds(robot), performance.now(), true);
        this.invalidate();
      }),
    );
  }

  private take(next: Frame): void {
    this.motion.push(next);
    if (contacts.value) {
      this.marks.set(next.contacts, this.robots.size(), this.weight());
      this.dirty = true;
    }
    this.wake();
  }

  /** A robot or a mesh has come, or one has gone. */
  private grown(): void {
    this.unseen = true;
    this.invalidate();
  }

  /** Newtons, of the heaviest that can move. */
  private weight(): number {
    const masses = [...this.robots.all()].map(({ scene }) => sum(scene.links.map((link) => (link.movable ? link.mass : 0))));
    return GRAVITY * Math.max(0, ...masses);
  }

  private tick(at: number): void {
    this.request = 0;
    // Nothing is known of the world yet: the first picture, which takes longest, is not of an empty one.
    if (frame.peek() === null && connection.peek().state !== "lost") return;
    // The time of the picture may be a little before that of the state that it is to show.
    const now = Math.max(at, performance.now());
    const moved = this.robots.pose(this.motion, now);
    if (this.unseen && this.robots.arePosed()) this.look(now);
    const pulled = this.hands.update();
    const flying = this.camera.update(now);
    if (moved || pulled || flying || this.dirty) this.draw(now);
    else this.reach(now);
    if (flying || pulled || !this.motion.isSettled(now)) this.wake();
  }

  /** What came is measured, and looked at unless somebody chose what to see. */
  private look(now: number): void {
    this.unseen = false;
    this.covered = 0;
    this.robots.show({ visuals: visuals.peek(), collisions: collisions.peek(), frames: frames.peek() });
    if (this.robots.meshes.isComplete()) this.measure();
    if (!this.camera.touched && scenes.peek().size > 0) this.camera.fit(this.robots.bounds(), now, false);
  }

  /** Those that this tab loaded are stood on the ground, which their description knows nothing of. */
  private measure(): void {
    const waiting = [...unmeasured.peek()].filter((name) => this.robots.get(name));
    if (waiting.length === 0) return;
    unmeasured.value = new Set([...unmeasured.peek()].filter((name) => !waiting.includes(name)));
    for (const name of waiting) {
      const lowest = this.robots.get(name)?.bounds().min.z ?? 0;
      if (lowest < -SUNK) void lift(name, -lowest);
    }
  }

  private draw(now: number): void {
    this.dirty = false;
    if (now - this.covered > SHADOW_INTERVAL) {
      this.covered = now;
      this.light.cover(this.robots.bounds().getBoundingSphere(new Sphere()));
    }
    const { target } = this.camera.controls;
    const distance = this.camera.distance();
    this.ground.follow(target.x, target.y, distance);
    // The ground ends in the distance, and nobody is to see where.
    this.fog.near = Math.max(12, 3 * distance);
    this.fog.far = Math.max(120, 8 * distance);
    this.renderer.render(this.scene, this.camera.camera);
    this.pictures += 1;
    this.reach(now);
  }

  private reach(now: number): void {
    this.drawn = this.motion.reached(now)?.sequence ?? this.drawn;
  }
}

function sum(numbers: number[]): number {
  return numbers.reduce((total, number) => total + number, 0);
}
