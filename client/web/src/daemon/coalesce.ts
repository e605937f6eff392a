// Coalesces changes that are made faster than the daemon answers: the newest of each key, one call in flight.

/** Collects values by key, and sends all pending ones in one call as soon as the call before has ended. */
export class Coalescer<K, V> {
  private pending = new Map<K, V>();
  private waiting: (() => void)[] = [];
  private inFlight = false;

  /** `send` must not reject: it reports errors to the user. */
  constructor(private readonly send: (values: Map<K, V>) => Promise<void>) {}

  /** Resolves once this value, or the newer one that replaced it, was sent. */
  set(key: K, value: V): Promise<void> {
    // Deleted first so that values are sent in the order of their last change.
    this.pending.delete(key);
    this.pending.set(key, value);
    const done = new Promise<void>((resolve) => this.waiting.push(resolve));
    if (!this.inFlight) void this.flush();
    return done;
  }

  /** Discards the pending values whose keys match. */
  drop(matches: (key: K) => boolean): void {
    for (const key of [...this.pending.keys()]) {
      if (matches(key)) this.pending.delete(key);
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
