// Draws the scene, and only after a change.
import { effect } from "@preact/signals";
import { Box3, Color, Fog, PCFShadowMap, Scene, Sphere, Vector2, WebGLRenderer } from "three";
import { shownRobot } from "../panels/shown-robot";
import { cameraTarget, type CameraTarget } from "../state/camera";
import { constraints, hoveredConstraint } from "../state/constraints";
import { film } from "../state/film";
import { linkColors, markers } from "../state/markers";
import { hiddenRobots } from "../state/tools";
import { inertias } from "../state/view";
import { drawnPictures, drawnSequence, pictureRequest, redraws } from "../state/picture";
import { ghosts, ghostsAlone } from "../state/playback";
import { hasGround, scenes } from "../state/scene";
import { readings } from "../state/sensors";
import { cameraMove, cameraView, centresOfMass, collisions, constraintsShown, contacts, fitRequest, followed, frames, grid, hoveredLink, jointAxes, linkNames, markersShown, orthographic, quality, readingsShown, sideViews, visuals } from "../state/view";
import { connection, frame, robots, simulation, type Frame } from "../state/world";
import { shownTheme } from "../style/theme";
import { Appearance } from "./appearance";
import { Camera } from "./camera";
import { reportCamera } from "./camera-report";
import { ConstraintMarks, type Finder } from "./constraints";
import { ContactScale } from "./contact-scale";
import { ContactMarks } from "./contacts";
import { Copies } from "./copies";
import { DrawnMarkers } from "./drawn-markers";
import { drawingContext } from "./drawing-context";
import { weightOf } from "./extent";
import { Extras } from "./extras";
import { Follower } from "./follower";
import { GhostViews } from "./ghosts";
import { Grid } from "./grid";
import { InputReport } from "./input-report";
import { Labels } from "./labels";
import { namesOf } from "./link-names";
import { PointerInteraction } from "./pointer-interaction";
import { Light } from "./light";
import { PoseInterpolator } from "./pose-interpolator";
import { PALETTES } from "./palette";
import { pictureOf } from "./picture";
import { RobotViews } from "./robot-views";
import type { SideViews } from "./side-views";
import { StructureMarks } from "./structure-marks";

/** Milliseconds between updates of the area that the shadow covers. */
const SHADOW_INTERVAL = 500;
/** Milliseconds after the last motion until a picture is drawn with all of its pixels. */
const REST = 200;

/** The scene of one canvas, and its render loop. */
export class Stage {
  readonly camera: Camera;
  readonly interpolator = new PoseInterpolator();
  readonly robots: RobotViews;
  readonly ghosts: GhostViews;
  /** Frames rendered so far. */
  pictures = 0;
  /** Number of calls that drew the last picture, without views from the sides. */
  calls = 0;
  /** The newest state that was drawn. */
  drawn = 0n;
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly fog = new Fog(0);
  private readonly grid = new Grid(this.scene);
  private readonly light = new Light(this.scene);
  readonly appearance: Appearance;
  readonly copies: Copies;
  private readonly pixels = new Vector2();
  readonly constraints = new ConstraintMarks();
  readonly markers = new DrawnMarkers();
  readonly structure = new StructureMarks();
  private readonly marks = new ContactMarks();
  private readonly labels: Labels;
  private readonly contactScale: ContactScale;
  private sides: SideViews | undefined;
  private readonly follower = new Follower();
  private readonly interaction: PointerInteraction;
  private readonly input: InputReport;
  readonly extras: Extras;
  /** Version of the newest `cameraTarget` that the camera has followed. */
  private followed = 0n;
  private readonly ends: (() => void)[] = [];
  private request = 0;
  private dirty = true;
  /** Whether the last picture has fewer pixels than a still one; the timer draws it with all. */
  private isCoarse = false;
  private resting: ReturnType<typeof setTimeout> | undefined;
  private covered = 0;
  /** Whether a robot or a mesh was added since the camera was last fitted. */
  private unfitted = false;
  /**
   * Robot to fit once its meshes are loaded, and the number of camera moves by the user at the time of the request.
   */
  private pendingFit: { robot: string; gestures: number } | null = null;

  /** Throws if the browser has no WebGL 2. */
  constructor(private readonly canvas: HTMLCanvasElement) {
    this.renderer = new WebGLRenderer({ canvas, context: drawingContext(canvas) });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    this.robots = new RobotViews(() => this.contentChanged());
    this.copies = new Copies(this.robots.meshes.primitives.sufficient);
    this.ghosts = new GhostViews(this.robots.meshes, this.robots.materials, () => this.contentChanged());
    this.scene.fog = this.fog;
    // Only what moves is computed again: the scene and the robots' group stay at the origin.
    for (const still of [this.scene, this.robots.group, this.copies.group]) still.matrixAutoUpdate = false;
    this.scene.onBeforeRender = (renderer, _, camera) => this.copies.place(camera, renderer.getDrawingBufferSize(this.pixels).y, this.appearance.quality === "high");
    this.scene.add(this.copies.group, this.robots.group, this.ghosts.group, this.constraints.group, this.structure.group, this.marks.group, this.markers.group);
    this.labels = new Labels(canvas);
    this.contactScale = new ContactScale(canvas);
    this.camera = new Camera(canvas, () => this.invalidate());
    this.appearance = new Appearance(this.renderer, this.scene, this.light, this.grid, this.camera.camera, () => this.invalidate());
    this.interaction = new PointerInteraction(canvas, this.camera, this.robots, () => this.wake());
    this.scene.add(this.interaction.rod.group);
    this.input = new InputReport(canvas);
    this.extras = new Extras({ scene: this.scene, camera: this.camera, canvas, robots: this.robots, changed: () => this.invalidate() });
    this.subscribe();
  }

  /** Requests a new frame. */
  invalidate(): void {
    this.dirty = true;
    this.wake();
  }

  /** Whether nothing is pending: the picture shows the newest state. */
  isSettled(): boolean {
    const still = this.camera.isStill() && this.interpolator.isSettled(performance.now());
    const sharp = !this.isCoarse || (!this.interpolator.isStill() && simulation.peek().state === "playing");
    const complete = this.interpolator.newest() !== null && this.robots.areLoaded() && this.appearance.isComplete() && !this.unfitted;
    return this.pictures > 0 && !this.dirty && still && sharp && complete;
  }

  resize(width: number, height: number): void {
    this.appearance.setPixels();
    this.renderer.setSize(width, height, false);
    this.camera.resize(width, height);
    this.invalidate();
    // Drawn at once, since the old picture is stretched until the next.
    if (this.pictures > 0) this.draw(performance.now());
    else this.paintBackground();
  }

  dispose(): void {
    cancelAnimationFrame(this.request);
    clearTimeout(this.resting);
    for (const end of this.ends) end();
    this.interaction.dispose();
    this.extras.dispose();
    this.input.dispose();
    this.markers.dispose();
    this.ghosts.dispose();
    this.robots.dispose();
    this.copies.dispose();
    this.constraints.dispose();
    this.structure.dispose();
    this.labels.dispose();
    this.contactScale.dispose();
    this.sides?.dispose();
    this.marks.dispose();
    this.grid.dispose();
    this.light.dispose();
    this.appearance.dispose();
    this.camera.dispose();
    this.renderer.dispose();
  }

  /** Requests an animation frame, which draws if something has changed. */
  private wake(): void {
    if (this.request === 0) this.request = requestAnimationFrame((now) => this.tick(now));
  }

  /** Keeps the scene up to date with the signals of the page. */
  private subscribe(): void {
    this.ends.push(
      effect(() => {
        this.robots.sync(scenes.value);
        this.contentChanged();
      }),
      effect(() => {
        void scenes.value;
        this.robots.color(linkColors.value);
        this.invalidate();
      }),
      effect(() => {
        if (frame.value) this.take(frame.value);
      }),
      effect(() => {
        this.robots.show({ visuals: visuals.value, collisions: collisions.value, frames: frames.value });
        this.robots.hide(hiddenRobots.value);
        this.invalidate();
      }),
      effect(() => {
        this.grid.show(grid.value);
        this.marks.group.visible = contacts.value && !(ghosts.value && ghostsAlone.value);
        this.invalidate();
      }),
      effect(() => {
        void [constraints.value, hoveredConstraint.value];
        this.constraints.group.visible = constraintsShown.value && !(ghosts.value && ghostsAlone.value);
        this.invalidate();
      }),
      effect(() => {
        this.markers.set(markers.value.values(), PALETTES[shownTheme.value].ink);
        this.markers.group.visible = markersShown.value && !(ghosts.value && ghostsAlone.value);
        this.invalidate();
      }),
      effect(() => {
        if (cameraTarget.value) this.follow(cameraTarget.value);
      }),
      effect(() => {
        const alone = ghosts.value !== null && ghostsAlone.value;
        this.robots.group.visible = !alone;
        if (this.ghosts.show(ghosts.value, alone)) this.contentChanged();
        this.invalidate();
      }),
      effect(() => {
        scenes.value;
        const changed = this.robots.highlight(hoveredLink.value);
        void [linkNames.value && shownRobot.value, jointAxes.value, centresOfMass.value, inertias.value, readingsShown.value && readings.value];
        // The link under the pointer shows its name, highlighted or not.
        if (changed || this.pictures > 0) this.invalidate();
      }),
      effect(() => this.appearance.choose(quality.value)),
      // A video has the size of its first picture.
      film.subscribe((running) => {
        if (running && this.isCoarse) this.draw(performance.now());
      }),
      effect(() => void this.showSides(sideViews.value)),
      redraws.subscribe(() => this.invalidate()),
      effect(() => {
        this.camera.setOrthographic(orthographic.value);
        this.invalidate();
      }),
      cameraMove.subscribe((move) => {
        if (move) this.camera.move(move, performance.now());
        this.invalidate();
      }),
      // Starts from its present position, even if nothing is drawn before it moves.
      followed.subscribe((name) => void this.follower.update(name, this.robots, this.camera)),
      pictureRequest.subscribe((request) => request?.taken(this.picture(request.width, request.height))),
      effect(() => {
        if (connection.value.state === "lost") this.wake();
      }),
      effect(() => {
        const palette = PALETTES[shownTheme.value];
        this.scene.background = new Color(palette.background);
        this.fog.color.set(palette.background);
        this.robots.materials.ground.color.set(palette.ground);
        this.grid.paint(palette);
        this.light.paint(palette);
        this.paintBackground();
        this.invalidate();
      }),
      fitRequest.subscribe(({ robot, count }) => {
        if (count === 0) return;
        this.camera.fit(this.bounds(robot), performance.now(), true);
        const isComplete = this.robots.meshes.isComplete() && !this.unfitted;
        this.pendingFit = isComplete ? null : { robot, gestures: this.camera.gestures };
        this.invalidate();
      }),
    );
  }

  /** Shows the background alone until the first state can be drawn. */
  private paintBackground(): void {
    if (this.pictures > 0) return;
    this.renderer.setClearColor(PALETTES[shownTheme.peek()].background);
    this.renderer.clear();
  }

  /** Shows views from the sides, whose code is loaded on first use, or hides them. */
  private async showSides(shown: boolean): Promise<void> {
    if (!shown) {
      this.sides?.dispose();
      this.sides = undefined;
    } else if (!this.sides) {
      const loaded = await import("./side-views").catch(() => undefined);
      if (!loaded) sideViews.value = false;
      else if (sideViews.peek()) this.sides ??= new loaded.SideViews(this.canvas);
    }
    this.invalidate();
  }

  /** Moves the camera as a program requests, unless the user has moved it later in this tab. */
  private follow({ version, position, target, fieldOfView, isOld }: CameraTarget): void {
    if (isOld && cameraView.peek()) this.camera.widen(fieldOfView);
    else this.camera.look(position, target, fieldOfView);
    this.followed = version;
    this.invalidate();
  }

  private take(next: Frame): void {
    this.interpolator.push(next);
    if (contacts.value && this.marks.set(next.contacts, this.robots.size(), weightOf(this.robots))) this.dirty = true;
    if (this.isAtRest()) this.updateDrawn(performance.now());
    else this.wake();
  }

  /** Whether the last picture already shows the newest state: it needs no frame. */
  private isAtRest(): boolean {
    if (this.request !== 0 || this.dirty || this.unfitted || !this.interpolator.isStill()) return false;
    // Compared with the drawn state, so that a slow motion adds up.
    const moved = this.robots.pose(this.interpolator, performance.now());
    this.dirty ||= moved;
    return !moved;
  }

  /** Returns a PNG of the view, of this many pixels. */
  private async picture(width: number, height: number): Promise<Blob> {
    const made = this.rendered(width, height);
    // Runs before the browser shows the canvas at the other size.
    this.draw(performance.now());
    return made;
  }

  private async rendered(width: number, height: number): Promise<Blob> {
    return pictureOf(this.renderer, () => this.appearance.draw(this.camera.distance()), this.camera.camera, width, height);
  }

  /** A robot or a mesh was added or removed. */
  private contentChanged(): void {
    this.unfitted = true;
    this.invalidate();
  }

  private tick(at: number): void {
    this.request = 0;
    // Before the first state nothing is drawn: the first frame is the slowest, and would be empty.
    if (frame.peek() === null && connection.peek().state !== "lost") return;
    // The time of the animation frame may precede the newest state's time.
    const now = Math.max(at, performance.now());
    const moved = this.robots.pose(this.interpolator, now);
    if (this.unfitted && this.robots.arePosed()) this.fitContent(now);
    const dragging = this.interaction.update();
    const carried = this.follower.update(followed.peek(), this.robots, this.camera);
    const flying = this.camera.update(now);
    const moves = moved || dragging || carried || flying;
    const draws = moves || this.dirty;
    // A picture with all pixels between two with fewer would flicker.
    if (draws) this.draw(now, moves || this.isCoarse);
    else this.updateDrawn(now);
    if (flying || dragging || !this.interpolator.isSettled(now)) this.wake();
    this.appearance.measure(at, draws, this.request !== 0);
  }

  /** Measures new content, and fits the camera to it unless the user has moved the camera. */
  private fitContent(now: number): void {
    this.unfitted = false;
    this.covered = 0;
    this.robots.forgetRadii();
    this.robots.show({ visuals: visuals.peek(), collisions: collisions.peek(), frames: frames.peek() });
    const isGroundFound = this.robots.findGround();
    const isComplete = this.robots.meshes.isComplete();
    if (isComplete) hasGround.value = isGroundFound;
    const { pendingFit } = this;
    if (isComplete) this.pendingFit = null;
    if (pendingFit?.gestures === this.camera.gestures) this.camera.fit(this.bounds(pendingFit.robot), now, true);
    const isEmpty = scenes.peek().size === 0 && !ghosts.peek();
    if (!this.camera.movedByUser && !isEmpty) this.camera.fit(this.bounds(), now, false);
  }

  /** Bounds of one robot, or of everything. */
  private bounds(robot = ""): Box3 {
    const recorded = robot === "" ? this.ghosts.bounds() : new Box3();
    if (recorded.isEmpty()) return this.robots.bounds(robot);
    return scenes.peek().size > 0 && this.robots.group.visible ? recorded.union(this.robots.bounds()) : recorded;
  }

  /** Draws everything, with fewer pixels during motion on a slow machine. */
  private draw(now: number, moves = false): void {
    this.dirty = false;
    this.isCoarse = this.appearance.setPixels(moves && film.peek() === null);
    clearTimeout(this.resting);
    if (this.isCoarse) this.resting = setTimeout(() => this.draw(performance.now()), REST);
    if (now - this.covered > SHADOW_INTERVAL) {
      this.covered = now;
      this.light.cover(this.bounds().getBoundingSphere(new Sphere()), this.camera.controls.target, this.camera.distance());
    }
    if (constraints.peek().length > 0 || this.constraints.anchors.size > 0) {
      this.constraints.set(constraints.peek(), this.frameOf, hoveredConstraint.peek(), this.robots.size(), weightOf(this.robots));
    }
    this.markers.pose(this.robots.worldFromLink);
    this.extras.update();
    this.structure.set(this.robots.all(), this.robots.radiusOf, { axes: jointAxes.peek(), masses: centresOfMass.peek(), inertias: inertias.peek() });
    const { target } = this.camera.controls;
    const distance = this.camera.distance();
    this.grid.follow(target.x, target.y, distance);
    // The fog hides the edge of the ground.
    this.fog.near = Math.max(12, 3 * distance);
    this.fog.far = Math.max(120, 8 * distance);
    this.copies.gather(this.robots.group);
    this.calls = this.appearance.draw(distance);
    this.sides?.draw(this.renderer, this.scene, this.camera);
    this.labels.show([...namesOf(this.robots.all()), ...this.marks.labels()], this.camera.camera);
    this.contactScale.show(this.marks.group.visible ? this.marks.metresPerNewton() : 0, this.camera.camera, distance);
    this.pictures += 1;
    this.updateDrawn(now);
    drawnPictures.value = this.pictures;
    reportCamera(this.camera, this.renderer.getSize(new Vector2()), this.followed);
  }

  /** Returns world_from_link of the end of a constraint, as drawn. */
  private readonly frameOf: Finder = ({ robot, link, joint }) => {
    const moved = robots.peek().find(({ name }) => name === robot)?.axes.find((axis) => axis.joint === joint)?.childLink;
    const named = joint === "" ? link : moved;
    return named ? this.robots.worldFromLink(robot, named) : undefined;
  };

  private updateDrawn(now: number): void {
    this.drawn = this.interpolator.reached(now)?.sequence ?? this.drawn;
    drawnSequence.value = this.drawn;
  }
}
