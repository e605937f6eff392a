// Data that pages share with programs: markers, cameras, keys and mouse.
import { batch } from "@preact/signals";
import type { NextViewResponse } from "../gen/simd/v1/view_pb";
import { cameraTarget, shownCamera, type ShownCamera } from "../state/camera";
import { inputCount, inputFor, takeInput } from "../state/input";
import { linkColors, markers } from "../state/markers";
import { connection, role } from "../state/world";
import { cameraTargetOf, colorsOf, inputOf, markerOf } from "./markers";
import { PollLoop } from "./poll-loop";
import type { Services } from "./services";

/** Milliseconds between two polls while something changes, and otherwise. */
const INTERVAL = 1000 / 30;
const IDLE_INTERVAL = 500;
/** Milliseconds after the last change in which another is likely. */
const ACTIVE_FOR = 2000;
/** Milliseconds between two reports of the camera. */
const CAMERA_INTERVAL = 100;
/** Seconds; 0 would mean the default of one second. */
const NO_WAIT = 0.001;
const CALL = { timeoutMs: 5000 };
/** Maximum number of events in one report. */
const MAX_EVENTS = 256;

/** Makes one call after the other, none of which waits at the daemon. */
export class ViewLink {
  private readonly loop = new PollLoop(() => this.run());
  private version = 0n;
  private changedAt = -Infinity;
  private reported: ShownCamera | null = null;
  private reportedAt = -Infinity;

  constructor(private readonly services: Services) {
    inputCount.subscribe((count) => {
      if (count > 0) this.loop.wake();
    });
  }

  /** Starts polling, or stops it while the page is hidden. */
  setVisible(visible: boolean): void {
    if (visible) this.loop.start();
    else this.loop.stop();
  }

  /** Forgets the former daemon. */
  begin(): void {
    this.version = 0n;
    this.reported = null;
    this.loop.wake();
  }

  /** Returns the milliseconds until the next poll. */
  private async run(): Promise<number> {
    if (connection.value.state !== "live") return IDLE_INTERVAL;
    try {
      await this.fetch();
      await this.report();
    } catch {
      // The poll of states detects a lost daemon, and a daemon of an older version has no markers.
    }
    const isActive = inputFor.value !== null || performance.now() - this.changedAt < ACTIVE_FOR;
    return isActive ? INTERVAL : IDLE_INTERVAL;
  }

  private async fetch(): Promise<void> {
    const afterVersion = this.version;
    const answer = await this.services.view.nextView({ afterVersion, timeout: NO_WAIT }, CALL);
    // A viewer's token does not allow reports.
    inputFor.value = answer.wantsInput && role.value !== "viewer" ? answer.inputClient : null;
    if (answer.version === afterVersion) return;
    this.version = answer.version;
    this.changedAt = performance.now();
    this.take(answer, afterVersion === 0n);
  }

  private take({ whole, markers: changed, deleted, colors, camera }: NextViewResponse, isFirst: boolean): void {
    batch(() => {
      if (whole || changed.length > 0 || deleted.length > 0) {
        const next = new Map(whole ? [] : markers.value);
        for (const id of deleted) next.delete(id);
        for (const wire of changed) {
          const marker = markerOf(wire);
          if (marker) next.set(wire.id, marker);
        }
        if (next.size > 0 || markers.value.size > 0) markers.value = next;
      }
      if (colors) linkColors.value = colorsOf(colors);
      else if (isFirst && linkColors.value.size > 0) linkColors.value = new Map();
      if (camera && (isFirst || camera.version !== cameraTarget.value?.version)) {
        cameraTarget.value = cameraTargetOf(camera, isFirst);
      }
    });
  }

  private async report(): Promise<void> {
    const now = performance.now();
    const input = takeInput();
    if (role.value === "viewer") return;
    const camera = shownCamera.value;
    const isDue = camera !== null && camera !== this.reported && now - this.reportedAt >= CAMERA_INTERVAL;
    if (!isDue && input.length === 0) return;
    if (isDue) {
      this.reported = camera;
      this.reportedAt = now;
      this.changedAt = now;
    }
    await this.services.view.reportView(
      {
        ...(isDue ? { camera: messageOf(camera) } : {}),
        followedVersion: (isDue ? camera : this.reported)?.followed ?? 0n,
        input: input.slice(-MAX_EVENTS).map(inputOf),
      },
      CALL,
    );
  }
}

function messageOf({ position, target, fieldOfView, width, height }: ShownCamera) {
  const vector = ([x, y, z]: readonly [number, number, number]) => ({ x, y, z });
  return { position: vector(position), target: vector(target), up: { x: 0, y: 0, z: 1 }, fieldOfView, width, height };
}
