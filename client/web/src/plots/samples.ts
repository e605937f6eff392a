// The last stretch of a recording: columns of numbers over a time that only grows, in plain arrays that plots can read.

/** Columns beside the time. `NaN` is a value that there was not. */
export class Samples {
  private time: Float64Array<ArrayBuffer>;
  private columns = new Map<string, Float64Array<ArrayBuffer>>();
  private start = 0;
  private end = 0;

  /** Keeps `span` seconds, and never more than `most` samples: the oldest go first. */
  constructor(
    readonly span: number,
    readonly most: number,
    capacity = 1024,
  ) {
    this.time = new Float64Array(Math.min(capacity, 2 * most));
  }

  get length(): number {
    return this.end - this.start;
  }

  /** Time of the newest sample; `-Infinity` before there is one. */
  get last(): number {
    return this.length > 0 ? (this.time[this.end - 1] ?? -Infinity) : -Infinity;
  }

  get names(): string[] {
    return [...this.columns.keys()];
  }

  /** Adds a column, without values so far. One that is there stays. */
  add(name: string): void {
    if (this.columns.has(name)) return;
    this.columns.set(name, new Float64Array(this.time.length).fill(NaN));
  }

  remove(name: string): void {
    this.columns.delete(name);
  }

  /** Forgets what was recorded; columns stay. */
  clear(): void {
    this.start = 0;
    this.end = 0;
  }

  /**
   * Appends a sample, or puts it in the newest one's place where no time has passed. A time before the newest
   * one begins the recording anew. `valueOf` gives each column's value.
   */
  push(time: number, valueOf: (name: string) => number): void {
    if (time < this.last) this.clear();
    if (time > this.last) {
      if (this.end === this.time.length) this.makeRoom();
      this.end += 1;
    }
    const at = this.end - 1;
    this.time[at] = time;
    for (const [name, column] of this.columns) column[at] = valueOf(name);
    while (this.length > this.most || time - (this.time[this.start] ?? time) > this.span) this.start += 1;
  }

  /** The times, oldest first: a view, until the next `push`. */
  times(): Float64Array {
    return this.time.subarray(this.start, this.end);
  }

  /** A column beside `times`; empty where there is none of that name. */
  column(name: string): Float64Array {
    return this.columns.get(name)?.subarray(this.start, this.end) ?? new Float64Array(0);
  }

  /** What was recorded until now, by itself. */
  copy(): Samples {
    const other = new Samples(this.span, this.most, this.length + 1);
    other.time.set(this.times());
    other.end = this.length;
    for (const name of this.columns.keys()) {
      other.add(name);
      other.columns.get(name)?.set(this.column(name));
    }
    return other;
  }

  /** Moves what is kept to the front where half of the arrays is spent; else doubles them. */
  private makeRoom(): void {
    const length = this.length;
    const capacity = this.start >= this.time.length / 2 ? this.time.length : 2 * this.time.length;
    const moved = (old: Float64Array): Float64Array<ArrayBuffer> => {
      const fresh = capacity === old.length ? (old as Float64Array<ArrayBuffer>) : new Float64Array(capacity);
      fresh.set(old.subarray(this.start, this.end));
      fresh.fill(NaN, length);
      return fresh;
    };
    this.time = moved(this.time);
    for (const [name, column] of this.columns) this.columns.set(name, moved(column));
    this.start = 0;
    this.end = length;
  }
}
