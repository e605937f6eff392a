// Throttling of calls: only the newest, one at a time, and no faster than an interval.

/** Makes the newest of the requested calls. */
export class Throttle {
  private waiting: (() => Promise<unknown>) | null = null;
  private busy = false;
  private ended = false;

  /** `interval`: minimum time between the starts of two calls, milliseconds. */
  constructor(private readonly interval: number) {}

  /** Requests a call in place of the waiting one. `call` must not reject. */
  next(call: () => Promise<unknown>): void {
    this.waiting = call;
    if (!this.busy) void this.run();
  }

  /** Drops the waiting call. */
  end(): void {
    this.ended = true;
    this.waiting = null;
  }

  private async run(): Promise<void> {
    this.busy = true;
    while (this.waiting && !this.ended) {
      const call = this.waiting;
      this.waiting = null;
      const pause = new Promise<void>((resolve) => setTimeout(resolve, this.interval));
      await call();
      if (this.waiting) await pause;
    }
    this.busy = false;
  }
}
