// Updates one row of the joint panel from the state of its axis, and sends the targets that the user sets.
import { presentValue, setTarget } from "../daemon/actions";
import { axisValues } from "../state/joint-values";
import { toast } from "../state/toasts";
import { degrees } from "../state/view";
import { robots, simulation, type Axis, type JointValues, type Mode, type Target } from "../state/world";
import { PendingTarget, PENDING_TIMEOUT } from "./pending-target";
import { type Follower, show } from "./row-updates";
import { digits, parse, quantityOf, unitOf, type Quantity, type Unit } from "./quantity";
import { printable } from "./printable";
import { fractionOf, nudgeOf, rangeOf, turned, type Range } from "./range";
import { whatHolds } from "./what-holds";

/** The elements of a row that change. A joint without an actuator has no inputs. */
export interface RowParts {
  row: HTMLElement;
  fill: HTMLElement;
  /** Markers as wide as the slider, moved by percentages of their width, which needs no layout. */
  tick: HTMLElement;
  zero: HTMLElement;
  readout: HTMLElement;
  badge: HTMLElement;
  slider: HTMLInputElement | null;
  number: HTMLInputElement | null;
  mode: HTMLSelectElement | null;
}

/** Updates the row of an axis, and handles its input. */
export class AxisControl implements Follower {
  readonly robot: string;
  readonly element: HTMLElement;
  private readonly pending = new PendingTarget();
  private mode: Mode = "none";
  private target = 0;
  private present: Record<Quantity, number> = { position: 0, velocity: 0, effort: 0 };
  private refreshTimer: ReturnType<typeof setTimeout> | undefined;
  /** Number of the user's inputs. */
  private inputs = 0;
  private quantity: Quantity = "position";
  private range: Range;
  private unit: Unit;
  /** The last written text by name, so that nothing is written twice. */
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
    const own = axisValues(this.axis, values);
    if (!own) return;
    const { position, velocity, effort, mode, target, flags, blockedBy } = own;
    this.present = { position, velocity, effort };
    const shown = this.pending.shown({ mode, value: target }, performance.now());
    this.mode = shown.mode;
    // A joint that is not driven has no target: the handle follows its position.
    this.target = shown.mode === "passive" || shown.mode === "none" ? position : shown.value;
    this.updateRange();
    this.write(flags, blockedBy);
  }

  /** Sets the range of the slider for the mode. */
  private updateRange(): void {
    const quantity = quantityOf(this.mode);
    this.unit = unitOf(this.axis.kind, quantity, degrees.peek());
    const range = rangeOf(this.axis, quantity);
    // The range must not change during a drag.
    if (quantity !== this.quantity || !this.pending.isHeld) {
      this.range = quantity === "position" ? turned(range, this.target, this.quantity === quantity ? this.range : range) : range;
    }
    this.quantity = quantity;
  }

  private write(flags: number, blockedBy: string): void {
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
    const { position: at, velocity } = this.present;
    const disabledReason = robots.peek().find(({ name }) => name === this.robot)?.disabledReason ?? "";
    const hold = whatHolds({ axis: this.axis, mode, target: this.target, position: at, velocity, flags, blockedBy, disabledReason, world: simulation.peek().state });
    this.once("badge", hold ? `${hold.word}: ${hold.sentence}` : "", () => {
      parts.badge.textContent = hold?.word ?? "";
      parts.badge.title = hold ? printable(hold.sentence) : "";
      parts.row.toggleAttribute("data-strained", hold !== undefined);
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
      if (!this.pending.isHeld) this.once("slider", String(this.target), (text) => void (slider.value = text));
      this.once("said", said, (text) => slider.setAttribute("aria-valuetext", text));
    }
    if (number && (document.activeElement !== number || number.dataset["typed"] === undefined)) {
      this.once("number", said, (text) => {
        number.value = text;
        if (document.activeElement === number) number.select();
      });
    }
  }

  /** Calls `put` if the text differs from the last one. */
  private once(what: string, text: string, put: (text: string) => void): void {
    if (this.written.get(what) === text) return;
    this.written.set(what, text);
    put(text);
  }

  /** Sets the target in the present mode; a joint that is passive or holds changes to position mode. */
  private setValue(value: number): void {
    const mode = this.mode === "velocity" || this.mode === "effort" ? this.mode : "position";
    this.send(mode, value);
  }

  private send(mode: Mode, value: number, before: Target = { mode: this.mode, value: this.target }): void {
    this.pend({ mode, value });
    const { inputs } = this;
    void setTarget(this.axis, { mode, value }, before).then(() => {
      if (inputs === this.inputs) this.answered();
    });
  }

  /** Shows a target that the daemon has not reported yet. */
  private pend(target: Target): void {
    this.inputs += 1;
    this.pending.set(target, performance.now());
    show(this);
  }

  private answered(): void {
    this.pending.answered(performance.now());
    // A refused target must not be shown until the next state, which may not come while the world is paused.
    clearTimeout(this.refreshTimer);
    this.refreshTimer = setTimeout(() => show(this), PENDING_TIMEOUT + 50);
  }

  /**
   * The first target of the new mode is the present value, so that the joint does not jerk. The daemon is asked for it: the page's last state of
   * a joint that moves is old.
   */
  async changeMode(mode: Mode): Promise<void> {
    const before = { mode: this.mode, value: this.target };
    const quantity = quantityOf(mode);
    const shown = mode === "passive" ? 0 : this.present[quantity];
    this.pend({ mode, value: shown });
    const { inputs } = this;
    const value = mode === "passive" ? 0 : ((await presentValue(this.axis, quantity)) ?? shown);
    // The user has set another target meanwhile.
    if (inputs === this.inputs) this.send(mode, value, before);
  }

  drag(value: number): void {
    if (Number.isFinite(value)) this.setValue(value);
  }

  beginDrag(): void {
    this.pending.hold();
  }

  endDrag(): void {
    this.pending.release(performance.now());
    this.written.delete("slider");
    show(this);
  }

  /** Moves the target by this many nudges, within the limits. */
  nudge(count: number): void {
    const { range } = this;
    const step = nudgeOf(range, this.unit);
    // The target is rounded to whole steps, so that a nudge back returns to the same value.
    const next = Math.round((this.target + count * step) / step) * step;
    const low = range.openLower ? -Infinity : range.lower;
    const high = range.openUpper ? Infinity : range.upper;
    this.setValue(Math.min(high, Math.max(low, next)));
  }

  /** Sets a typed target, or shows a toast with the fault. Returns whether it was set. */
  type(text: string): boolean {
    const value = parse(text, this.axis.kind, quantityOf(this.mode), this.unit);
    if (typeof value === "string") {
      toast("error", `${this.axis.label}: ${value}.`);
      return false;
    }
    this.setValue(value);
    return true;
  }

  /** Writes everything again, for instance after a change of the unit. */
  refresh(): void {
    this.written.clear();
    show(this);
  }
}
