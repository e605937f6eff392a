// Pictures of cameras while they are shown: one call at a time for all of them, so that they take one connection of the browser.
import { PlaneCompression, type CameraPicture, type PicturePlane } from "../gen/simd/v1/camera_pb";
import type { SensorPicture } from "../state/pictures";
import { connection } from "../state/world";
import { messageOf } from "./error-message";
import { PollLoop } from "./poll-loop";
import { services, type Services } from "./services";

/** Milliseconds between two rounds. */
const INTERVAL = 200;
/** Milliseconds until the next round after a refusal: a renderer may be started meanwhile. */
const AFTER_REFUSAL = 2000;
/** Wall seconds that the page waits for a picture. */
const WAIT = 2;
/** Metres that are drawn black; nearer ones are lighter. */
const DARK = 10;

/** Called with a picture of a camera, or with the reason for its absence. */
export type OnPicture = (picture: SensorPicture | undefined, problem: string) => void;

interface Followed {
  robot: string;
  sensor: string;
  onPicture: OnPicture;
  /** Sequence number of the last picture that was passed on. */
  sequence: bigint;
}

/** Fetches the pictures of cameras, in turn, as long as one is followed. */
export class PictureFollower {
  private readonly followed = new Set<Followed>();
  private readonly loop = new PollLoop(() => this.round());
  private visible = true;

  constructor(private readonly services: () => Services) {}

  /** Fetches pictures, or none while the page is hidden. */
  setVisible(visible: boolean): void {
    this.visible = visible;
    this.update();
  }

  /** Calls `onPicture` with each new picture of a camera from now on. Returns a function that ends that. */
  follow(robot: string, sensor: string, onPicture: OnPicture): () => void {
    const one = { robot, sensor, onPicture, sequence: 0n };
    this.followed.add(one);
    this.update();
    this.loop.wake();
    return () => {
      this.followed.delete(one);
      this.update();
    };
  }

  private update(): void {
    if (this.visible && this.followed.size > 0) this.loop.start();
    else this.loop.stop();
  }

  /** Returns the milliseconds until the next round. */
  async round(): Promise<number> {
    let delay = INTERVAL;
    for (const one of this.followed) {
      // Only the connection calls a lost daemon, until it answers.
      if (!this.visible || connection.peek().state !== "live") break;
      try {
        const { robot, sensor } = one;
        const { picture } = await this.services().cameras.getPicture({ robot, sensor, timeout: WAIT }, { timeoutMs: 1000 * (WAIT + 3) });
        // A still world has the same picture.
        if (!picture || picture.sequence === one.sequence) continue;
        one.sequence = picture.sequence;
        const shown = await shownOf(picture);
        if (this.followed.has(one)) one.onPicture(shown, "");
      } catch (error) {
        if (this.followed.has(one)) one.onPicture(undefined, messageOf(error));
        delay = AFTER_REFUSAL;
      }
    }
    return delay;
  }
}

let ours: PictureFollower | undefined;

/** Shows the pictures of a camera until the returned function is called. */
export function followPicture(robot: string, sensor: string, onPicture: OnPicture): () => void {
  ours ??= ofThisPage();
  return ours.follow(robot, sensor, onPicture);
}

/** This code is loaded with the first camera, so the page's connection does not know it. */
function ofThisPage(): PictureFollower {
  const follower = new PictureFollower(services);
  const update = () => follower.setVisible(!document.hidden);
  document.addEventListener("visibilitychange", update);
  update();
  return follower;
}

/** Returns the first plane of a picture as colours: depths are lighter the nearer, and each link has a separate colour. */
export async function shownOf(picture: CameraPicture): Promise<SensorPicture> {
  const { width, height, color, depth, segmentation, stamp } = picture;
  const count = width * height;
  const pixels = new Uint8ClampedArray(4 * count);
  const paint = (pixel: number, [red, green, blue]: readonly [number, number, number]) => {
    pixels.set([red, green, blue, 255], 4 * pixel);
  };
  if (color) {
    const bytes = await unpacked(color, 3 * count);
    for (let pixel = 0; pixel < count; pixel += 1) paint(pixel, [bytes[3 * pixel] ?? 0, bytes[3 * pixel + 1] ?? 0, bytes[3 * pixel + 2] ?? 0]);
  } else if (depth) {
    const view = viewOf(await unpacked(depth, 4 * count));
    for (let pixel = 0; pixel < count; pixel += 1) {
      const near = 1 - Math.min(view.getFloat32(4 * pixel, true) / DARK, 1);
      paint(pixel, [255 * near, 255 * near, 255 * near]);
    }
  } else if (segmentation) {
    const view = viewOf(await unpacked(segmentation, 4 * count));
    for (let pixel = 0; pixel < count; pixel += 1) paint(pixel, colorOf(view.getUint32(4 * pixel, true)));
  }
  return { width, height, pixels, time: stamp?.simTime ?? 0 };
}

/** Consecutive numbers have very different colours: hues are a golden part of a turn apart. */
function colorOf(link: number): readonly [number, number, number] {
  if (link === 0) return [255, 255, 255];
  const hue = (link * 0.618034) % 1;
  const part = (shift: number) => 255 * Math.min(1, Math.max(0, Math.abs(((hue + shift) % 1) * 6 - 3) - 1));
  return [part(0), part(2 / 3), part(1 / 3)];
}

function viewOf(bytes: Uint8Array): DataView {
  return new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
}

/** Returns the numbers of a plane. Throws if it has the wrong size, before it unpacks more. */
async function unpacked({ compression, data }: PicturePlane, size: number): Promise<Uint8Array> {
  if (compression === PlaneCompression.UNSPECIFIED) {
    if (data.length !== size) throw new Error("the picture is not of its size");
    return data;
  }
  const bytes = new Uint8Array(size);
  let length = 0;
  const reader = new Blob([data.slice()]).stream().pipeThrough(new DecompressionStream("deflate")).getReader();
  for (;;) {
    const { done, value } = await reader.read();
    if (done) break;
    if (length + value.length > size) {
      await reader.cancel();
      throw new Error("the picture is not of its size");
    }
    bytes.set(value, length);
    length += value.length;
  }
  if (length !== size) throw new Error("the picture is not of its size");
  return bytes;
}
