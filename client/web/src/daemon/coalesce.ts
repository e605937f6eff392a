// Sends changes that come faster than the daemon answers: the newest of each kind, one call in flight.

/** Gathers values by key, and sends all that wait at once as soon as the call before has ended. */
export class Coalescer<K, V> {
  private pending = new Map<K, V>();
  private waiting: (() => void)[] = [];
  private inFlight = false;

  /** `send` must not reject: it tells people itself what was refused. */
  constructor(private readonly send: (values: Map<K, V>) => Promise<void>) {}

  /** Answers once this value, or the newer one that took its place, was sent. */
  set(key: K, value: V): Promise<void> {
    // Deleted first so that what was set last is sent last.
    this.pending.delete(key);
    this.pending.set(key, value);
    const done = new Promise<void>((resolve) => this.waiting.push(resolve));
    if (!this.inFlight) void this.flush();
    return done;
  }

  /** Forgets the values that wait for the call in flight and that `fits` names. */
  drop(fits: (key: K) => boolean): void {
    for (const key of [...this.pending.keys()]) {
      if (fits(key)) this.pending.delete(key);
    }
  }

  private async flush(): Promise<void> {
    this.inFlight = true;
    while (this.waiting.length > 0) {
      const values = this.pending;
      const waiting = this.waiting;
      this.pending = new Map();
      this.waiting = [];
      if (values.size > 0) await this.send(values);
      for (const resolve of waiting) resolve();
    }
    this.inFlight = false;
  }
}
