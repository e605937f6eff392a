// Conversion of sensors and their readings from messages to the state of the page.
import type { Sensor as Wire, SensorInfo, SensorReading, SensorReadings } from "../gen/simd/v1/sensor_pb";
import type { Lens, Measurement, Scan, Sensor, SensorKind, Sweep } from "../state/sensors";
import { poseOf, vectorOf } from "./mapping";

const KINDS: Record<string, SensorKind> = {
  imu: "imu",
  forceTorque: "force-torque",
  contact: "contact",
  range: "range",
  lidar: "lidar",
  linkState: "link state",
  encoder: "encoder",
  odometry: "odometry",
  camera: "camera",
} satisfies Partial<Record<NonNullable<Wire["kind"]["case"]>, SensorKind>>;

export function sensorOf({ sensor, unavailable }: SensorInfo): Sensor {
  const { robot = "", name = "", link = "", joint = "", rate, kind } = sensor ?? {};
  // A kind from a newer version of the schema is still a sensor.
  const scan = scanOf(kind);
  const lens = lensOf(kind);
  return { robot, name, kind: KINDS[kind?.case ?? ""] ?? "sensor", on: joint === "" ? link : joint, rate, unavailable, ...((scan ?? lens) && { pose: poseOf(sensor?.pose) }), ...(scan && { scan }), ...(lens && { lens }) };
}

const STRAIGHT: Sweep = { samples: 1, min: 0, max: 0 };

/** Returns the rays of a sensor that measures ranges: a range finder has one, along x. */
function scanOf(kind: Wire["kind"] | undefined): Scan | undefined {
  if (kind?.case === "range") return { horizontal: STRAIGHT, vertical: STRAIGHT };
  if (kind?.case !== "lidar") return undefined;
  const { horizontal, vertical } = kind.value;
  return { horizontal: sweepOf(horizontal), vertical: sweepOf(vertical) };
}

function lensOf(kind: Wire["kind"] | undefined): Lens | undefined {
  if (kind?.case !== "camera") return undefined;
  const { width, height, horizontalFieldOfView, near, far } = kind.value;
  return { width, height, fieldOfView: horizontalFieldOfView, near, far };
}

function sweepOf(sweep: { samples: number; min: number; max: number } | undefined): Sweep {
  return sweep ? { samples: sweep.samples, min: sweep.min, max: sweep.max } : STRAIGHT;
}

/** The newest reading of each, by the sensor's name. */
export function readingsOf(all: readonly SensorReadings[]): Map<string, Measurement> {
  const found = new Map<string, Measurement>();
  for (const { sensor, readings } of all) {
    const newest = readings.at(-1);
    if (newest) found.set(sensor, measurementOf(newest));
  }
  return found;
}

export function measurementOf({ measurement }: SensorReading): Measurement {
  switch (measurement.case) {
    case "imu":
      return { kind: "imu", acceleration: vectorOf(measurement.value.linearAcceleration), angular: vectorOf(measurement.value.angularVelocity) };
    case "forceTorque":
      return { kind: "force-torque", force: vectorOf(measurement.value.force), torque: vectorOf(measurement.value.torque) };
    case "contact": {
      const { touching, normalForce, partners } = measurement.value;
      return { kind: "contact", touching, normalForce, partners: partners.map(({ robot, link }) => `${robot}/${link}`) };
    }
    case "range":
      return { kind: "range", range: measurement.value.range };
    case "lidar": {
      let hits = 0;
      let nearest = Infinity;
      for (const range of measurement.value.ranges) {
        if (!Number.isFinite(range)) continue;
        hits += 1;
        nearest = Math.min(nearest, range);
      }
      return { kind: "lidar", rays: measurement.value.ranges.length, hits, nearest, ranges: measurement.value.ranges };
    }
    case "linkState":
    case "odometry": {
      const { pose, twist } = measurement.value;
      return { kind: "motion", position: vectorOf(pose?.position), linear: vectorOf(twist?.linear), angular: vectorOf(twist?.angular) };
    }
    case "encoder":
      return { kind: "encoder", position: measurement.value.position, velocity: measurement.value.velocity };
    default:
      return { kind: "unknown" };
  }
}
