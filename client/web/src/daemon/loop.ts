// Does something again and again, never twice at once, and not while it is stopped.

/** A loop whose `turn` says in how many milliseconds the next one is due. */
export class Loop {
  private running = false;
  private busy = false;
  private woken = false;
  private timer: ReturnType<typeof setTimeout> | undefined;

  constructor(private readonly turn: () => Promise<number>) {}

  start(): void {
    if (this.running) return;
    this.running = true;
    this.wake();
  }

  /** The turn that is under way comes to its end; no other begins. */
  stop(): void {
    this.running = false;
    clearTimeout(this.timer);
  }

  /** The next turn begins now, or when the present one has ended. */
  wake(): void {
    if (!this.running) return;
    clearTimeout(this.timer);
    if (this.busy) {
      this.woken = true;
    } else {
      void this.run();
    }
  }

  private async run(): Promise<void> {
    this.busy = true;
    this.woken = false;
    const delay = await this.turn();
    this.busy = false;
    if (!this.running) return;
    this.timer = setTimeout(() => void this.run(), this.woken ? 0 : delay);
  }
}
