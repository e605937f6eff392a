// A recording as comma-separated values: SI units, named in the header.

/** A column to write. */
export interface Column {
  /** For instance `arm/elbow.position`. */
  name: string;
  /** For instance `rad`; none is written where it is empty. */
  unit: string;
  /** Numbers; a NaN is an empty field. Or words. */
  values: ArrayLike<number | string>;
}

/** The columns beside each other, the longest one's length, with a header. Lines end as RFC 4180 has it. */
export function csv(columns: readonly Column[]): string {
  const length = Math.max(0, ...columns.map((column) => column.values.length));
  const lines = [columns.map(({ name, unit }) => field(unit === "" ? name : `${name} [${unit}]`)).join(",")];
  for (let row = 0; row < length; row += 1) {
    lines.push(columns.map(({ values }) => field(values[row])).join(","));
  }
  return `${lines.join("\r\n")}\r\n`;
}

function field(value: number | string | undefined): string {
  if (value === undefined || (typeof value === "number" && !Number.isFinite(value))) return "";
  const text = typeof value === "number" ? number(value) : value;
  return /[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
}

/** Nine digits are more than a plot or a fit needs, and hide what is only rounding. */
function number(value: number): string {
  return String(Number(value.toPrecision(9)));
}
