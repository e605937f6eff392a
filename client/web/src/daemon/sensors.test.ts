// Sensors in the page's form.
import { create } from "@bufbuild/protobuf";
import { expect, test } from "vitest";
import { SensorInfoSchema, SensorReadingSchema, SensorReadingsSchema, SensorSchema } from "../gen/simd/v1/sensor_pb";
import { measurementOf, readingsOf, sensorOf } from "./sensors";

test("every kind of sensor and every measurement of the schema has a separate name", () => {
  const kinds = SensorSchema.oneofs[0]?.fields ?? [];
  const names = kinds.map((field) => {
    const kind = { case: field.localName, value: create(field.message ?? SensorSchema) };
    return sensorOf(create(SensorInfoSchema, { sensor: { robot: "arm", name: "it", kind: kind as never } })).kind;
  });
  expect(new Set(names).size).toBe(kinds.length);
  expect(names).not.toContain("sensor");
  for (const field of SensorReadingSchema.oneofs[0]?.fields ?? []) {
    const measurement = { case: field.localName, value: create(field.message ?? SensorSchema) };
    expect(measurementOf(create(SensorReadingSchema, { measurement: measurement as never })).kind).not.toBe("unknown");
  }
  expect(measurementOf(create(SensorReadingSchema)).kind).toBe("unknown");
});

test("a sensor of a joint is on it, and one without a rate measures each step", () => {
  const sensor = { robot: "arm", name: "wrist", joint: "elbow", kind: { case: "forceTorque" as const, value: {} } };
  expect(sensorOf(create(SensorInfoSchema, { sensor }))).toEqual({ robot: "arm", name: "wrist", kind: "force-torque", on: "elbow", rate: undefined, unavailable: "" });
});

test("a scan shows its nearest hit, and the newest reading counts", () => {
  const scan = (ranges: number[]) => ({ measurement: { case: "lidar" as const, value: { ranges, columns: ranges.length } } });
  const readings = create(SensorReadingsSchema, { robot: "arm", sensor: "eye", readings: [scan([1]), scan([2, Infinity, -Infinity, NaN, 1.5])] });
  const silent = create(SensorReadingsSchema, { robot: "arm", sensor: "camera" });
  expect(readingsOf([readings, silent])).toEqual(new Map([["eye", { kind: "lidar", rays: 5, hits: 2, nearest: 1.5, ranges: [2, Infinity, -Infinity, NaN, 1.5] }]]));
});

test("a lidar has its angles and its pose, a range finder one ray along x, and a camera its lens", () => {
  const horizontal = { samples: 5, min: -1, max: 1 };
  const pose = { position: { x: 1, y: 2, z: 3 } };
  const lidar = sensorOf(create(SensorInfoSchema, { sensor: { robot: "arm", name: "eye", pose, kind: { case: "lidar", value: { horizontal } } } }));
  expect(lidar.scan).toEqual({ horizontal, vertical: { samples: 1, min: 0, max: 0 } });
  expect(lidar.pose).toEqual([1, 2, 3, 0, 0, 0, 1]);
  const range = sensorOf(create(SensorInfoSchema, { sensor: { robot: "arm", name: "eye", kind: { case: "range", value: {} } } }));
  expect(range.scan?.horizontal.samples).toBe(1);
  const camera = { width: 32, height: 24, horizontalFieldOfView: 1, near: 0.1, far: 10 };
  const eye = sensorOf(create(SensorInfoSchema, { sensor: { robot: "arm", name: "eye", pose, kind: { case: "camera", value: camera } } }));
  expect(eye.lens).toEqual({ width: 32, height: 24, fieldOfView: 1, near: 0.1, far: 10 });
  expect(eye.pose).toEqual([1, 2, 3, 0, 0, 0, 1]);
});
