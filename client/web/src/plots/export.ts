// Exports a recording as comma-separated values.
import { quantityOf, unitOf } from "../panels/quantity";
import type { Axis } from "../state/world";
import { csv, type Column } from "./csv";
import { columnOf, MODES } from "./recorder";
import type { Samples } from "./samples";

/** The time, then position, velocity, effort, target and mode of each axis, in SI units. */
export function asCsv(samples: Samples, axes: readonly Axis[]): string {
  const columns: Column[] = [{ name: "sim_time", unit: "s", values: samples.times() }];
  for (const axis of axes) {
    for (const quantity of ["position", "velocity", "effort"] as const) {
      columns.push({ name: `${axis.key}.${quantity}`, unit: unitOf(axis.kind, quantity, false).name, values: samples.column(columnOf(axis.key, quantity)) });
    }
    const modes = Array.from(samples.column(columnOf(axis.key, "mode")), (code) => MODES[code] ?? "none");
    const driven = (at: number): boolean => modes[at] !== "passive" && modes[at] !== "none";
    const units = new Set(modes.filter((_, at) => driven(at)).map((mode) => unitOf(axis.kind, quantityOf(mode), false).name));
    const [only] = units;
    columns.push({
      name: `${axis.key}.target`,
      unit: units.size === 1 && only !== undefined ? only : "as .mode says",
      values: samples.column(columnOf(axis.key, "target")).map((value, at) => (driven(at) ? value : NaN)),
    });
    columns.push({ name: `${axis.key}.mode`, unit: "", values: modes });
  }
  return csv(columns);
}
