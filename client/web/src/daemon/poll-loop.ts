// Repeats an asynchronous task, one run at a time, until it is stopped.

/** A loop whose `task` returns the milliseconds until its next run. */
export class PollLoop {
  private running = false;
  private busy = false;
  private woken = false;
  private timer: ReturnType<typeof setTimeout> | undefined;

  constructor(private readonly task: () => Promise<number>) {}

  start(): void {
    if (this.running) return;
    this.running = true;
    this.wake();
  }

  /** A run in progress completes; no other starts. */
  stop(): void {
    this.running = false;
    clearTimeout(this.timer);
  }

  /** Starts the next run now, or right after the one in progress. */
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
    const delay = await this.task();
    this.busy = false;
    if (!this.running) return;
    this.timer = setTimeout(() => void this.run(), this.woken ? 0 : delay);
  }
}
