// The file that people open in a spreadsheet or read with pandas.
import { expect, test } from "vitest";
import { csv } from "./csv";

test("columns have their units in the header, and absent values are empty", () => {
  const text = csv([
    { name: "sim_time", unit: "s", values: [0, 0.1] },
    { name: "arm/elbow.position", unit: "rad", values: new Float64Array([0.1 + 0.2, NaN]) },
    { name: "arm/elbow.mode", unit: "", values: ["position", "passive"] },
  ]);
  expect(text).toBe("sim_time [s],arm/elbow.position [rad],arm/elbow.mode\r\n0,0.3,position\r\n0.1,,passive\r\n");
});

test("a name with a comma or a quote is one field", () => {
  expect(csv([{ name: 'a,"b"', unit: "m", values: [1] }])).toBe('"a,""b"" [m]"\r\n1\r\n');
});

test("nothing recorded is a header", () => {
  expect(csv([{ name: "sim_time", unit: "s", values: [] }])).toBe("sim_time [s]\r\n");
});
