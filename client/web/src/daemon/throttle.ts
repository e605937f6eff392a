// Throttling of calls: only the newest, one at a time, and no faster than an interval.

type Call = () => Promise<unknown>;

/** Makes the newest of the requested calls. */
export class Throttle {
  private waiting: Call | null = null;
  /** Calls that no later one replaces, in order. */
  private readonly last: Call[] = [];
  private isBusy = false;
  private working: Promise<void> = Promise.resolve();
  private ended = false;

  /** `interval`: minimum time between the starts of two calls, milliseconds. */
  constructor(private readonly interval: number) {}

  /** Requests a call in place of the waiting one. `call` must not reject. Resolves once nothing waits any more. */
  next(call: Call): Promise<void> {
    this.waiting = call;
    return this.run();
  }

  /** Requests the last call of a series, in place of the waiting one: no later call replaces it, and `end` does not drop it. */
  finish(call: Call): Promise<void> {
    this.waiting = null;
    this.last.push(call);
    return this.run();
  }

  /** Drops the waiting call. */
  end(): void {
    this.ended = true;
    this.waiting = null;
  }

  private run(): Promise<void> {
    if (!this.isBusy) {
      this.isBusy = true;
      this.working = this.work();
    }
    return this.working;
  }

  private async work(): Promise<void> {
    for (let call = this.take(); call; call = this.take()) {
      const pause = new Promise<void>((resolve) => setTimeout(resolve, this.interval));
      await call();
      if (this.waiting || this.last.length > 0) await pause;
    }
    this.isBusy = false;
  }

  /** Returns the next call; undefined if none waits. */
  private take(): Call | undefined {
    const call = this.last.shift() ?? (this.ended ? undefined : (this.waiting ?? undefined));
    if (call === this.waiting) this.waiting = null;
    return call;
  }
}
