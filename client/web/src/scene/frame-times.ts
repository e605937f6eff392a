// Detects pictures that come so slowly that less should be drawn.

/** Interval above which pictures are too slow, milliseconds. */
const SLOW = 40;
/** Interval below which more can be drawn, milliseconds. */
const FAST = 20;
/** Interval above which added detail takes excessive time, milliseconds. */
const LATE = 25;
/** Default number of intervals that are considered. */
const COUNT = 24;
/** A longer interval is not a slow picture: the tab was hidden, or the machine slept. */
const LONGEST = 2000;

/** Measures the time between consecutive pictures. */
export class FrameTimes {
  private intervals: number[] = [];
  private last: number | undefined;

  constructor(private readonly count = COUNT) {}

  /**
   * Takes the time of an animation frame in milliseconds, whether it drew, and whether it requested the next.
   */
  take(at: number, drew: boolean, goesOn: boolean): void {
    if (drew && this.last !== undefined && at - this.last < LONGEST) {
      this.intervals.push(at - this.last);
      if (this.intervals.length > this.count) this.intervals.shift();
    }
    this.last = drew && goesOn ? at : undefined;
  }

  /** Whether half of the newest pictures took too long. */
  isSlow(): boolean {
    return (this.median() ?? 0) > SLOW;
  }

  /** Whether half of the newest pictures came so fast that each may take longer. */
  isFast(): boolean {
    return (this.median() ?? Infinity) < FAST;
  }

  /** Whether half of the newest pictures were slower than added detail allows. */
  isLate(): boolean {
    return (this.median() ?? 0) > LATE;
  }

  /** Returns the median milliseconds between the newest pictures; undefined while they are too few. */
  median(): number | undefined {
    return this.intervals.length < this.count ? undefined : [...this.intervals].sort((a, b) => a - b)[Math.floor(this.count / 2)];
  }

  /** Forgets all times. */
  forget(): void {
    this.intervals = [];
    this.last = undefined;
  }
}
