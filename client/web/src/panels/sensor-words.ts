// Measurements of sensors in words.
import type { Measurement } from "../state/sensors";
import { shortened } from "./quantity";

export function words(measured: Measurement): string {
  switch (measured.kind) {
    case "imu":
      return `${vector(measured.acceleration)} m/s² · ${vector(measured.angular)} rad/s`;
    case "force-torque":
      return `${vector(measured.force)} N · ${vector(measured.torque)} N m`;
    case "contact":
      return measured.touching ? `${shortened(measured.normalForce)} N from ${measured.partners.join(", ")}` : "touches nothing";
    case "range":
      return rangeOf(measured.range);
    case "lidar":
      return measured.hits === 0 ? `nothing in reach of ${measured.rays} rays` : `${measured.hits} of ${measured.rays} rays, nearest ${shortened(measured.nearest)} m`;
    case "motion":
      return `at ${vector(measured.position)} m · ${vector(measured.linear)} m/s`;
    case "encoder":
      return `${shortened(measured.position)} · ${shortened(measured.velocity)} a second`;
    case "unknown":
      return "unknown to this page";
  }
}

/** REP 117: infinity is out of reach, minus infinity too near, and NaN a lost ray. */
function rangeOf(range: number): string {
  if (Number.isFinite(range)) return `${shortened(range)} m`;
  return range > 0 ? "nothing in reach" : range < 0 ? "too near" : "lost";
}

function vector(values: readonly [number, number, number]): string {
  return values.map((value) => shortened(value)).join(" ");
}
