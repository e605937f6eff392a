// The last part of a recording: columns of numbers over an increasing time, in arrays that plots can read.

/** Columns with their times; `NaN` is an absent value. */
export class Samples {
  private time: Float64Array<ArrayBuffer>;
  private columns = new Map<string, Float64Array<ArrayBuffer>>();
  private start = 0;
  private end = 0;

  /** Keeps the last `span` seconds, and at most the last `most` samples. */
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

  /** Time of the newest sample; `-Infinity` without one. */
  get last(): number {
    return this.length > 0 ? (this.time[this.end - 1] ?? -Infinity) : -Infinity;
  }

  get names(): string[] {
    return [...this.columns.keys()];
  }

  /** Adds a column of absent values, unless it exists. */
  add(name: string): void {
    if (this.columns.has(name)) return;
    this.columns.set(name, new Float64Array(this.time.length).fill(NaN));
  }

  remove(name: string): void {
    this.columns.delete(name);
  }

  /** Removes all samples and keeps the columns. */
  clear(): void {
    this.start = 0;
    this.end = 0;
  }

  /**
   * Appends a sample, or replaces the newest one if the time is the same. An earlier time clears the recording first.
   * `valueOf` returns the value of each column.
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

  /** A column, aligned with `times`; empty if it does not exist. */
  column(name: string): Float64Array {
    return this.columns.get(name)?.subarray(this.start, this.end) ?? new Float64Array(0);
  }

  /** A copy. */
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

  /** Moves the samples to the front of the arrays if half of these is free, else doubles the arrays. */
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
