// Whether pictures come so slowly that less should be drawn.

/** Milliseconds from one picture to the next that are too many. */
const SLOW = 40;
/** So many intervals are looked at. */
const COUNT = 24;
/** What is longer is no picture that took long: the tab was hidden, or the machine asleep. */
const LONGEST = 2000;

/** Measures the time between pictures that follow upon each other. */
export class FrameTimes {
  private intervals: number[] = [];
  private last: number | undefined;

  /** Takes the time of an animation frame in milliseconds: whether it drew, and whether it asked for the next. */
  take(at: number, drew: boolean, goesOn: boolean): void {
    if (drew && this.last !== undefined && at - this.last < LONGEST) {
      this.intervals.push(at - this.last);
      if (this.intervals.length > COUNT) this.intervals.shift();
    }
    this.last = drew && goesOn ? at : undefined;
  }

  /** Whether half of the newest pictures took too long. */
  isSlow(): boolean {
    if (this.intervals.length < COUNT) return false;
    return ([...this.intervals].sort((a, b) => a - b)[COUNT / 2] ?? 0) > SLOW;
  }

  /** Begins anew. */
  forget(): void {
    this.intervals = [];
    this.last = undefined;
  }
}
