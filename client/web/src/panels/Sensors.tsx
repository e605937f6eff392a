// What a robot's sensors measured last.
import type { JSX } from "preact";
import { useEffect } from "preact/hooks";
import { readings, sensors, sensorsShownOf, type Measurement, type Sensor } from "../state/sensors";
import { CameraPicture } from "./CameraPicture";
import { shortened } from "./quantity";

/** The sensors of a robot; nothing where it has none. */
export function Sensors({ robot }: { robot: string }): JSX.Element | null {
  useEffect(() => {
    sensorsShownOf.value = robot;
    return () => {
      sensorsShownOf.value = "";
    };
  }, [robot]);
  const own = sensors.value.filter((sensor) => sensor.robot === robot);
  if (own.length === 0) return null;
  return (
    <section class="constraints" aria-label="Sensors" data-testid="sensors">
      <h2>Sensors</h2>
      <ul>
        {own.map((sensor) => (
          <Row key={sensor.name} sensor={sensor} />
        ))}
      </ul>
    </section>
  );
}

function Row({ sensor: { robot, name, kind, on, rate, unavailable } }: { sensor: Sensor }): JSX.Element {
  const newest = readings.value.get(name);
  return (
    <li data-testid={`sensor-${name}`}>
      <div class="constraint-line">
        <b title={name}>{name}</b>
        <span class="constraint-force" data-testid="sensor-reading">
          {newest ? words(newest) : kind === "camera" ? "" : "no reading yet"}
        </span>
      </div>
      <p class="hint">
        {kind} on {on}, {rate === undefined ? "each step" : `${shortened(rate)} Hz`}
        {unavailable !== "" && kind !== "camera" && `; ${unavailable}`}
      </p>
      {kind === "camera" && <CameraPicture robot={robot} sensor={name} />}
    </li>
  );
}

function words(measured: Measurement): string {
  switch (measured.kind) {
    case "imu":
      return `${vector(measured.acceleration)} m/s² · ${vector(measured.angular)} rad/s`;
    case "force-torque":
      return `${vector(measured.force)} N · ${vector(measured.torque)} N m`;
    case "contact":
      return measured.touching ? `${shortened(measured.normalForce)} N from ${measured.partners.join(", ")}` : "touches nothing";
    case "range":
      return Number.isFinite(measured.range) ? `${shortened(measured.range)} m` : "nothing in reach";
    case "lidar":
      return measured.hits === 0 ? `nothing in reach of ${measured.rays} rays` : `${measured.hits} of ${measured.rays} rays, nearest ${shortened(measured.nearest)} m`;
    case "motion":
      return `at ${vector(measured.position)} m · ${vector(measured.linear)} m/s`;
    case "encoder":
      return `${shortened(measured.position)} · ${shortened(measured.velocity)} a second`;
    case "unknown":
      return "something that this page does not know";
  }
}

function vector(values: readonly [number, number, number]): string {
  return values.map((value) => shortened(value)).join(" ");
}
