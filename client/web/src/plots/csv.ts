// Comma-separated values, in SI units with a header.

/** A column to write. */
export interface Column {
  /** For instance `arm/elbow.position`. */
  name: string;
  /** For instance `rad`; may be empty. */
  unit: string;
  /** Numbers, of which NaN is an empty field, or strings. */
  values: ArrayLike<number | string>;
}

/** A table of the columns with a header; shorter columns end with empty fields. Lines end as in RFC 4180. */
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

/** Nine significant digits, which hides rounding errors. */
function number(value: number): string {
  return String(Number(value.toPrecision(9)));
}
