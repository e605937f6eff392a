// One row of the joint panel at work: what the joint does, what it is asked to do, and what people do to the row.
import { setTarget } from "../daemon/actions";
import { toast } from "../state/toasts";
import { degrees } from "../state/view";
import type { Axis, JointValues, Mode } from "../state/world";
import { Asked, PATIENCE } from "./asked";
import { type Follower, show } from "./live";
import { digits, parse, quantityOf, unitOf, type Quantity, type Unit } from "./quantity";
import { fractionOf, nudgeOf, rangeOf, turned, type Range } from "./range";

/** The parts of a row that change. A joint that takes no targets has no inputs. */
export interface RowParts {
  row: HTMLElement;
  fill: HTMLElement;
  /** Marks as wide as the slider, moved by parts of their own width: moving them lays nothing out. */
  tick: HTMLElement;
  zero: HTMLElement;
  readout: HTMLElement;
  badge: HTMLElement;
  slider: HTMLInputElement | null;
  number: HTMLInputElement | null;
  mode: HTMLSelectElement | null;
}

const SATURATED = 1;
const AT_LOWER = 2;
const AT_UPPER = 4;

/** Writes an axis to its row, and sends what people do there. */
export class AxisControl implements Follower {
  readonly robot: string;
  readonly element: HTMLElement;
  private readonly asked = new Asked();
  private mode: Mode = "none";
  private target = 0;
  private present: Record<Quantity, number> = { position: 0, velocity: 0, effort: 0 };
  private lookAgain: ReturnType<typeof setTimeout> | undefined;
  private quantity: Quantity = "position";
  private range: Range;
  private unit: Unit;
  /** What was written last, so that nothing is written twice. */
  private written = new Map<string, string>();

  constructor(
    private readonly axis: Axis,
    private readonly parts: RowParts,
  ) {
    this.robot = axis.robot;
    this.element = parts.row;
    this.range = rangeOf(axis, "position");
    this.unit = unitOf(axis.kind, "position", degrees.peek());
  }

  update(values: JointValues): void {
    const { positionIndex, velocityIndex } = this.axis;
    const position = values.position[positionIndex];
    const mode = values.mode[velocityIndex];
    if (position === undefined || mode === undefined) return;
    this.present = { position, velocity: values.velocity[velocityIndex] ?? 0, effort: values.effort[velocityIndex] ?? 0 };
    const shown = this.asked.shown({ mode, value: values.target[velocityIndex] ?? 0 }, performance.now());
    this.mode = shown.mode;
    // What is not driven has no target: the handle goes along with the joint.
    this.target = shown.mode === "passive" || shown.mode === "none" ? position : shown.value;
    this.measure();
    this.write(values.flags[velocityIndex] ?? 0);
  }

  /** The slider's ends for the mode. */
  private measure(): void {
    const quantity = quantityOf(this.mode);
    this.unit = unitOf(this.axis.kind, quantity, degrees.peek());
    const range = rangeOf(this.axis, quantity);
    // Ends that jumped while the slider is held would tear it from the hand.
    if (quantity !== this.quantity || !this.asked.isHeld) {
      this.range = quantity === "position" ? turned(range, this.target, this.quantity === quantity ? this.range : range) : range;
    }
    this.quantity = quantity;
  }

  private write(flags: number): void {
    const { parts, range, unit, mode } = this;
    const quantity = quantityOf(mode);
    const actual = this.present[quantity];
    const from = fractionOf(0, range);
    const to = fractionOf(actual, range);
    this.once("fill", `translateX(${(Math.min(from, to) * 100).toFixed(2)}%) scaleX(${Math.abs(to - from).toFixed(4)})`, (text) => {
      parts.fill.style.transform = text;
    });
    this.once("zero", `translateX(${(from * 100).toFixed(2)}%)`, (text) => {
      parts.zero.style.transform = text;
    });
    this.once("actual", `translateX(${(to * 100).toFixed(2)}%)`, (text) => {
      parts.tick.style.transform = text;
    });
    const position = digits(this.present.position, unitOf(this.axis.kind, "position", degrees.peek()));
    const own = `${digits(actual, unit)} ${unit.name}`;
    this.once("readout", quantity === "position" ? own : `at ${position}, ${own}`, (text) => {
      parts.readout.textContent = text;
    });
    const badge = flags & SATURATED ? "saturated" : flags & (AT_LOWER | AT_UPPER) ? "at limit" : "";
    this.once("badge", badge, (text) => {
      parts.badge.textContent = text;
      parts.row.toggleAttribute("data-strained", text !== "");
    });
    this.once("mode", mode, (text) => {
      parts.row.dataset["mode"] = text;
      if (parts.mode) parts.mode.value = text;
    });
    this.once("open", `${range.openLower ? "lower " : ""}${range.openUpper ? "upper" : ""}`, (text) => {
      parts.row.dataset["open"] = text;
    });
    this.writeInputs();
  }

  private writeInputs(): void {
    const { slider, number } = this.parts;
    const { range, unit } = this;
    const said = `${digits(this.target, unit)} ${unit.name}`;
    if (slider) {
      this.once("ends", `${range.lower} ${range.upper}`, () => {
        slider.min = String(range.lower);
        slider.max = String(range.upper);
        this.written.delete("slider");
      });
      if (!this.asked.isHeld) this.once("slider", String(this.target), (text) => void (slider.value = text));
      this.once("said", said, (text) => slider.setAttribute("aria-valuetext", text));
    }
    if (number && (document.activeElement !== number || number.dataset["typed"] === undefined)) {
      this.once("number", said, (text) => {
        number.value = text;
        if (document.activeElement === number) number.select();
      });
    }
  }

  /** Calls `put` where the text is another than before. */
  private once(what: string, text: string, put: (text: string) => void): void {
    if (this.written.get(what) === text) return;
    this.written.set(what, text);
    put(text);
  }

  /** Asks for a target, in the mode that the joint has; a joint that was free or held takes positions from then on. */
  private ask(value: number): void {
    const mode = this.mode === "velocity" || this.mode === "effort" ? this.mode : "position";
    this.send(mode, value);
  }

  private send(mode: Mode, value: number): void {
    this.asked.set({ mode, value }, performance.now());
    void setTarget(this.axis, mode, value);
    show(this);
    // What was refused must not stand there until the world moves on: it may be paused.
    clearTimeout(this.lookAgain);
    this.lookAgain = setTimeout(() => show(this), PATIENCE + 50);
  }

  /** The present value is the new mode's first target, so that nothing jerks. */
  changeMode(mode: Mode): void {
    this.send(mode, mode === "passive" ? 0 : this.present[quantityOf(mode)]);
  }

  drag(value: number): void {
    if (Number.isFinite(value)) this.ask(value);
  }

  beginDrag(): void {
    this.asked.hold();
  }

  endDrag(): void {
    this.asked.release(performance.now());
    this.written.delete("slider");
    show(this);
  }

  /** Moves the target by so many nudges; at limits it stays. */
  nudge(count: number): void {
    const { range } = this;
    const step = nudgeOf(range, this.unit);
    // Nudges land on whole steps, so that they can be undone and read well.
    const next = Math.round((this.target + count * step) / step) * step;
    const low = range.openLower ? -Infinity : range.lower;
    const high = range.openUpper ? Infinity : range.upper;
    this.ask(Math.min(high, Math.max(low, next)));
  }

  /** Takes what was typed; says in a toast what is wrong with it. Whether it was taken. */
  type(text: string): boolean {
    const value = parse(text, this.axis.kind, quantityOf(this.mode), this.unit);
    if (typeof value === "string") {
      toast("error", `${this.axis.label}: ${value}.`);
      return false;
    }
    this.ask(value);
    return true;
  }

  /** Writes everything again, for instance in another unit. */
  refresh(): void {
    this.written.clear();
    show(this);
  }
}
