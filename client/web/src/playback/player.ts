// Playback of an open recording: position, speed, and drawn state.
import { batch, signal } from "@preact/signals";
import type { RecordedState, Timeline } from "../recording/timeline";

/** Possible speeds, simulated seconds a second. */
export const SPEEDS: readonly number[] = [0.1, 0.2, 0.5, 1, 2, 5, 10];
/** Maximum time by which one picture advances, milliseconds: a page that was hidden continues where it was. */
const MAX_TICK = 250;

/** Plays one recording until it is stopped. */
export class Player {
  /** Position in states: from 0 to `timeline.count - 1`; between two states while it plays. */
  readonly position = signal(0);
  readonly playing = signal(false);
  readonly speed = signal(1);
  /** The state that is shown; null until the first is read. */
  readonly shown = signal<RecordedState | null>(null);
  /** Whether the requested state is being read. */
  readonly waiting = signal(true);
  /** Parts that could not be read. */
  readonly problems = signal<readonly string[]>([]);
  private request = 0;
  private last = 0;
  private wanted = 0;
  private reading = false;
  private stopped = false;

  constructor(
    readonly timeline: Timeline,
    /** Name of the recording. */
    readonly name: string,
  ) {
    this.seek(0);
  }

  /** The number of the last state. */
  get end(): number {
    return this.timeline.count - 1;
  }

  /** Moves to a state. */
  seek(position: number): void {
    this.position.value = Math.max(0, Math.min(this.end, position));
    void this.show();
  }

  /** Moves this many states forward, or back, and stops there. */
  step(by: number): void {
    this.playing.value = false;
    this.seek(Math.floor(this.position.peek()) + by);
  }

  /** Plays, from the beginning if it is at its end; or pauses. */
  toggle(): void {
    if (this.playing.peek()) {
      this.playing.value = false;
      this.seek(Math.floor(this.position.peek()));
      return;
    }
    if (this.position.peek() >= this.end) this.seek(0);
    this.playing.value = this.end > 0;
    this.last = performance.now();
    this.wake();
  }

  /** Ends all activity. */
  stop(): void {
    this.playing.value = false;
    this.stopped = true;
    cancelAnimationFrame(this.request);
  }

  private wake(): void {
    cancelAnimationFrame(this.request);
    this.request = requestAnimationFrame((now) => this.tick(now));
  }

  private tick(now: number): void {
    if (!this.playing.peek()) return;
    const passed = Math.max(0, Math.min(MAX_TICK, now - this.last)) / 1000;
    this.last = now;
    const { timeline } = this;
    // Playback waits for the state that is being read, rather than skip it.
    const next = Math.min(this.end, this.position.peek() + (passed * this.speed.peek()) / timeline.period);
    const state = timeline.peek(next);
    timeline.prefetch(timeline.nextPart(next));
    batch(() => {
      this.waiting.value = state === undefined;
      if (state) {
        this.position.value = next;
        this.take(state);
        if (next >= this.end) this.playing.value = false;
      }
    });
    this.wake();
  }

  /** Shows the state at the position once it is read. During a read, only the newest request waits. */
  private async show(): Promise<void> {
    this.wanted = Math.floor(this.position.peek());
    if (this.reading) return;
    this.reading = true;
    try {
      for (let number = -1; number !== this.wanted && !this.stopped; ) {
        number = this.wanted;
        this.waiting.value = this.shown.peek() === null || !this.timeline.isReady(number);
        // A state that cannot be fetched now is requested until it comes; the timeline pauses meanwhile.
        const state = await this.timeline.state(number).catch(() => undefined);
        if (!state) number = -1;
        else if (!this.stopped && !this.playing.peek()) this.take(state);
      }
    } finally {
      this.reading = false;
      this.waiting.value = false;
    }
  }

  private take(state: RecordedState): void {
    if (this.shown.peek()?.number !== state.number) this.shown.value = state;
    if (this.problems.peek().length !== this.timeline.problems.size) this.problems.value = [...this.timeline.problems];
  }
}
