// Joint values over a whole recording, as far as they are read: evenly spread at first, then denser, within bounds.
import type { Quantity } from "../panels/quantity";
import { columnOf } from "../plots/recorder";
import type { JointState } from "../recording/cdr";
import { Damage } from "../recording/source";
import { topicPart, type Timeline } from "../recording/timeline";
import type { Axis } from "../state/world";

/** Number of values of a line: more than any screen has pixels, so that a zoom shows detail. */
const MAX_SAMPLES = 60_000;
/** Maximum bytes of the file that are read for one set of lines. */
const MAX_READ = 256 << 20;
/** Milliseconds between two announcements. */
const ANNOUNCE = 100;
/** Milliseconds until missing data is requested again. */
const RETRY = 1000;
const QUANTITIES: readonly Quantity[] = ["position", "velocity", "effort"];

/** Columns over time, in the plots' form. */
export class Overview {
  /** Seconds since the recording began. */
  private readonly time: Float64Array;
  private readonly columns = new Map<string, Float64Array>();
  /** States from one value to the next. */
  private readonly stride: number;
  private stopped = false;

  constructor(
    private readonly timeline: Timeline,
    private readonly axes: readonly Axis[],
    /** Called when more data has been read. */
    private readonly changed: () => void,
  ) {
    this.stride = Math.ceil(timeline.count / MAX_SAMPLES);
    const length = Math.ceil(timeline.count / this.stride);
    this.time = Float64Array.from({ length }, (_, at) => at * this.stride * timeline.period);
    for (const { key } of axes) {
      for (const quantity of QUANTITIES) this.columns.set(columnOf(key, quantity), new Float64Array(length).fill(NaN));
    }
  }

  times(): Float64Array {
    return this.time;
  }

  /** Empty if none has that name. */
  column(name: string): Float64Array {
    return this.columns.get(name) ?? new Float64Array(0);
  }

  /** Reads the recording until it is complete, or the bound is reached. Resolves to whether it is complete. */
  async read(): Promise<boolean> {
    const spans = this.timeline.spans();
    let bytes = 0;
    let announced = performance.now();
    for (const index of spread(spans.length)) {
      const span = spans[index];
      if (!span || this.stopped) return false;
      bytes += span.bytes;
      if (bytes > MAX_READ) return false;
      await this.readSpan(span.first);
      if (performance.now() - announced < ANNOUNCE) continue;
      announced = performance.now();
      this.changed();
    }
    this.changed();
    return true;
  }

  stop(): void {
    this.stopped = true;
  }

  private async readSpan(first: number): Promise<void> {
    const states = await this.statesOf(first);
    states.forEach((joints, offset) => {
      const number = first + offset;
      if (number % this.stride !== 0) return;
      for (const { key, robot, joint } of this.axes) {
        const values = joints.get(topicPart(robot));
        const index = values?.name.indexOf(joint) ?? -1;
        if (!values || index < 0) continue;
        for (const quantity of QUANTITIES) {
          const column = this.columns.get(columnOf(key, quantity));
          if (column) column[number / this.stride] = values[quantity][index] ?? NaN;
        }
      }
    });
  }

  /**
   * Damaged parts are gaps; the time line shows the reason. Parts that the daemon cannot send now are requested until they
   * come, or all is stopped.
   */
  private async statesOf(first: number): Promise<readonly ReadonlyMap<string, JointState>[]> {
    while (!this.stopped) {
      try {
        return await this.timeline.jointsOf(first);
      } catch (error) {
        if (error instanceof Damage) break;
        await new Promise((resolve) => setTimeout(resolve, RETRY));
      }
    }
    return [];
  }
}

/** Yields numbers below `count`, so that the first of them are spread evenly: halves, quarters, and so on. */
export function* spread(count: number): Generator<number> {
  let bits = 0;
  while (2 ** bits < count) bits += 1;
  for (let at = 0; at < 2 ** bits; at += 1) {
    let reversed = 0;
    for (let bit = 0; bit < bits; bit += 1) reversed = reversed * 2 + (Math.floor(at / 2 ** bit) % 2);
    if (reversed < count) yield reversed;
  }
}
