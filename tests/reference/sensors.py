#!/usr/bin/env python3
"""Sensors beside MuJoCo: writes MuJoCo's measurements in the scenes of `sensor_scenes.py` into
`sensors.json`, and prints simd's differences.

    target/reference-venv/bin/python tests/reference/sensors.py
    SIMD_BINARY=target/debug/simd target/reference-venv/bin/python tests/reference/sensors.py beside

The first needs `mujoco` and writes the file, which `tests/physics/sensors/mujoco.rs` replays. The second
also needs the requirements of the Python client. It prints the largest difference of each quantity,
relative to its size if that is above 1.

Both step by Euler. A sensor of MuJoCo's `mj_step` shows the state and the acceleration at the start of the
step. simd's shows the state after the step and the mean acceleration over it, (v1 - v0) / h. The damping
is implicit in both. So MuJoCo's functions are called for that state and that acceleration: `mj_forward`,
then `mj_rnePostConstraint` and `mj_sensorAcc` with this `qacc`. The second column is the `sensordata` of
`mj_step`: it differs by the changes in a step.
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

import json_lines
from sensor_scenes import SCENES, Scene

HERE = Path(__file__).resolve().parent
REPOSITORY = HERE.parents[1]
TYPE = mujoco.mjtSensor
QUANTITIES = {
    TYPE.mjSENS_ACCELEROMETER: ("imu", "linear_acceleration"),
    TYPE.mjSENS_GYRO: ("imu", "angular_velocity"),
    TYPE.mjSENS_FORCE: ("force_torque", "force"),
    TYPE.mjSENS_TORQUE: ("force_torque", "torque"),
    TYPE.mjSENS_TOUCH: ("contact", "normal_force"),
    TYPE.mjSENS_RANGEFINDER: ("range", "range"),
    TYPE.mjSENS_FRAMEPOS: ("link_state", "position"),
    TYPE.mjSENS_FRAMEQUAT: ("link_state", "orientation"),
    TYPE.mjSENS_FRAMELINVEL: ("link_state", "linear_velocity"),
    TYPE.mjSENS_FRAMEANGVEL: ("link_state", "angular_velocity"),
    TYPE.mjSENS_JOINTPOS: ("encoder", "position"),
    TYPE.mjSENS_JOINTVEL: ("encoder", "velocity"),
}
"""simd's kind of sensor, and the part of its reading."""


def sensors(model: Any) -> list[tuple[str, str, int, int]]:
    """Returns for each sensor of MuJoCo: simd's sensor, the quantity, and the address of its data. simd's
    sensor has the name of the first at its place."""
    first: dict[tuple[str, int, int], str] = {}
    found = []
    for index in range(model.nsensor):
        kind, quantity = QUANTITIES[TYPE(model.sensor_type[index])]
        place = (kind, int(model.sensor_objtype[index]), int(model.sensor_objid[index]))
        name = first.setdefault(place, model.sensor(index).name)
        at = int(model.sensor_adr[index])
        found.append((name, quantity, at, at + int(model.sensor_dim[index])))
    return found


def begin(scene: Scene) -> tuple[Any, Any]:
    model = mujoco.MjModel.from_xml_string(scene.mjcf)
    model.opt.timestep, model.opt.integrator = scene.time_step, int(mujoco.mjtIntegrator.mjINT_EULER)
    model.opt.tolerance, model.opt.iterations = 0.0, 200
    if not scene.rests:
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    data = mujoco.MjData(model)
    for _, joint, position, velocity in scene.joints:
        at = model.joint(joint)
        data.qpos[at.qposadr[0]], data.qvel[at.dofadr[0]] = position, velocity
    for robot, linear, angular in scene.twists:
        at = int(model.body_dofadr[model.body(robot).id])
        # The root is not turned, so that its axes are the world's.
        data.qvel[at : at + 6] = [*linear, *angular]
    return model, data


def after_step(model: Any, data: Any, before: Any) -> Any:
    """Returns the sensors' values for the state after a step and the mean acceleration over it."""
    seen = mujoco.MjData(model)
    seen.qpos[:], seen.qvel[:], seen.qacc_warmstart[:] = data.qpos, data.qvel, data.qacc_warmstart
    mujoco.mj_forward(model, seen)
    seen.qacc[:] = (data.qvel - before) / model.opt.timestep
    mujoco.mj_rnePostConstraint(model, seen)
    mujoco.mj_sensorAcc(model, seen)
    return seen.sensordata.copy()


def values(quantity: str, data: Any) -> list[float]:
    """In simd's form: quaternions x y z w, and REP 117's infinity if a ray meets nothing."""
    if quantity == "orientation":
        return [float(part) for part in np.roll(data, -1)]
    if quantity == "range":
        # JSON has no infinity.
        return [float(data[0])] if data[0] >= 0 else [-1.0]
    return [float(part) for part in data]


def in_mujoco(scene: Scene) -> list[dict[str, Any]]:
    """Prints a row for each quantity of each step that is read."""
    model, data = begin(scene)
    known, rows = sensors(model), []
    for step in range(1, max(scene.steps) + 1):
        before = data.qvel.copy()
        mujoco.mj_step(model, data)
        if step not in scene.steps:
            continue
        measured = after_step(model, data, before)
        for name, quantity, start, end in known:
            rows.append({
                "step": step, "sensor": name, "quantity": quantity, "values": values(quantity, measured[start:end]),
                "of_step": values(quantity, data.sensordata[start:end]),
            })
    return rows


def make() -> None:
    cases = []
    for scene in SCENES:
        rows = in_mujoco(scene)
        for row in rows:
            del row["of_step"]
        joints = [{"robot": r, "joint": j, "position": q, "velocity": v} for r, j, q, v in scene.joints]
        twists = [{"robot": r, "linear": list(v), "angular": list(w)} for r, v, w in scene.twists]
        cases.append({
            "name": scene.name, "time_step": scene.time_step, "touches": scene.rests, "joints": joints, "twists": twists,
            "mjcf": scene.mjcf, "readings": rows,
        })
    out = {"made_by": f"sensors.py with MuJoCo {mujoco.__version__}", "cases": cases}
    (HERE / "sensors.json").write_text(json_lines.text(out))
    print(f"{len(cases)} cases")


def part(measurement: Any, quantity: str) -> np.ndarray:
    """Returns a quantity of a reading of the Python client."""
    match quantity:
        case "range":
            return np.array([measurement if np.isfinite(measurement) else -1.0])
        case "position" if hasattr(measurement, "pose"):
            return np.asarray(measurement.pose.position)
        case "orientation" if hasattr(measurement, "pose"):
            return np.asarray(measurement.pose.orientation)
        case "linear_velocity":
            return np.asarray(measurement.twist.linear)
        case "angular_velocity" if hasattr(measurement, "twist"):
            return np.asarray(measurement.twist.angular)
    return np.atleast_1d(np.asarray(getattr(measurement, quantity), dtype=float))


def difference(quantity: str, ours: np.ndarray, theirs: np.ndarray) -> float:
    """Returns the largest difference of its parts, relative to the size of the whole if that is above 1."""
    error = np.abs(ours - theirs).max()
    if quantity == "orientation":
        error = min(error, np.abs(ours + theirs).max())
    return float(error / max(1.0, np.linalg.norm(theirs)))


def in_simd(scene: Scene) -> dict[tuple[int, str], Any]:
    """Returns the measurement of each sensor by step and name."""
    sys.path[:0] = [str(REPOSITORY / "client/python/src"), str(REPOSITORY / "client/python/tests")]
    import simd_client
    from daemon import Daemon

    daemon = Daemon(name=f"sensors{os.getpid()}")
    found: dict[tuple[int, str], Any] = {}
    try:
        with simd_client.connect(f"{daemon.endpoint}#{daemon.name}") as simulation, tempfile.TemporaryDirectory() as folder:
            simulation.pause()
            simulation.set_physics(time_step=scene.time_step, integrator="euler")
            path = Path(folder) / "scene.xml"
            path.write_text(scene.mjcf)
            simulation.load(path, passive=True)
            robots = dict(simulation.robots)
            if not scene.rests:
                for robot in robots.values():
                    robot.set_collision_groups(0, 0)
            for name, joint, position, velocity in scene.joints:
                robots[name].reset_joints({joint: position}, {joint: velocity})
            for name, linear, angular in scene.twists:
                robots[name].set_state(twist=simd_client.Twist.of(linear, angular))
            done = 0
            for step in scene.steps:
                simulation.step(step - done)
                done = step
                for readings in simulation.sensors.read().values():
                    found.update({(step, name): reading.measurement for name, reading in readings.items()})
    finally:
        daemon.kill()
    return found


def beside() -> None:
    print("| scene | quantity | difference | of `mj_step` itself |\n|---|---|---|---|")
    for scene in SCENES:
        measured = in_simd(scene)
        worst: dict[str, list[float]] = {}
        for row in in_mujoco(scene):
            quantity = row["quantity"]
            ours = part(measured[row["step"], row["sensor"]], quantity)
            both = [difference(quantity, ours, np.array(row[of])) for of in ("values", "of_step")]
            known = worst.setdefault(quantity, [0.0, 0.0])
            worst[quantity] = [max(pair) for pair in zip(known, both)]
        for quantity, (after, of_step) in worst.items():
            print(f"| {scene.name} | {quantity.replace('_', ' ')} | {after:.1e} | {of_step:.1e} |", flush=True)


if __name__ == "__main__":
    beside() if sys.argv[1:] == ["beside"] else make()
