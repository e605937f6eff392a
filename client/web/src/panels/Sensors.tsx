// Latest measurements of a robot's sensors.
import type { JSX } from "preact";
import { useEffect } from "preact/hooks";
import { readings, sensors, sensorsShownOf, type Sensor } from "../state/sensors";
import { lazy } from "./lazy";
import { shortened } from "./quantity";
import { words } from "./sensor-words";

// Most robots have no camera.
const CameraPicture = lazy(async () => (await import("./CameraPicture")).CameraPicture, "The picture");

/** The sensors of a robot; nothing without any. */
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
