"""Robots of URDFs as MuJoCo's models, with simd's gains, damping and limits."""

from __future__ import annotations

import importlib
import tempfile
import xml.etree.ElementTree as xml
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from simd_client import Robot
from simd_client.geometry import FloatArray

# It has no types for this.
mujoco: Any = importlib.import_module("mujoco")

ROBOT, REST = ("1", "2"), ("2", "3")
"""contype and conaffinity: links touch everything but each other, as in simd."""


def standing(robot: Robot, urdf: Path, height: float, friction: float, time_step: float) -> str:
    """Returns MJCF of a robot with a free root, at a height above a plane."""
    model = _converted(urdf, {"visual"}, is_free=True)
    world = _child(model, "worldbody")
    for geom in world.iter("geom"):
        _touch(geom, ROBOT, friction)
    _child(world, "body").set("pos", f"0 0 {height}")
    ground = xml.Element("geom", type="plane", size="50 50 1")
    _touch(ground, REST, friction)
    world.insert(0, ground)
    return _driven(model, robot, time_step)


def fixed(robot: Robot, urdf: Path, time_step: float) -> str:
    """Returns MJCF of a robot on a fixed base without shapes, with contacts switched off."""
    model = _converted(urdf, {"visual", "collision"}, is_free=False)
    xml.SubElement(_child(model, "option"), "flag", contact="disable")
    return _driven(model, robot, time_step)


def positions(model: Any, names: tuple[str, ...]) -> list[int]:
    """Returns the joints' indices in `qpos`."""
    return [int(model.joint(name).qposadr[0]) for name in names]


def posed(model: Any, pose: Mapping[str, float]) -> FloatArray:
    """Returns `qpos` of a model with joints at these positions, and everything else at its file's values."""
    qpos: FloatArray = np.array(model.qpos0, dtype=np.float64)
    qpos[positions(model, tuple(pose))] = list(pose.values())
    return qpos


def _converted(urdf: Path, without: set[str], *, is_free: bool) -> xml.Element:
    """Returns a URDF as MuJoCo writes it, without some elements of links."""
    robot = xml.fromstring(urdf.read_text())
    for link in robot.iter("link"):
        for shape in [each for each in link if each.tag in without]:
            link.remove(shape)
    robot.insert(0, xml.fromstring('<mujoco><compiler strippath="false" balanceinertia="true"/></mujoco>'))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / urdf.name
        path.write_text(xml.tostring(robot, encoding="unicode"))
        spec = mujoco.MjSpec.from_file(str(path))
    if is_free:
        spec.worldbody.first_body().add_freejoint()
    spec.compile()
    return xml.fromstring(spec.to_xml())


def _driven(model: xml.Element, robot: Robot, time_step: float) -> str:
    """Adds position actuators. simd's damping becomes damping of joints here, which Euler integrates
    implicitly: as an actuator's `kv` it would not be stable."""
    option = _child(model, "option")
    option.set("timestep", str(time_step))
    option.set("integrator", "Euler")
    by_name = robot.layout.by_name
    for joint in _child(model, "worldbody").iter("joint"):
        info = by_name.get(joint.get("name", ""))
        if info is not None and info.is_actuated:
            joint.set("damping", str(info.damping + info.default_gains.damping))
    actuators = _child(model, "actuator")
    for info in by_name.values():
        if not info.is_actuated:
            continue
        limits = info.limits
        low, high = (-10.0 if limits.lower is None else limits.lower), (10.0 if limits.upper is None else limits.upper)
        actuator = xml.SubElement(actuators, "position", name=info.name, joint=info.name)
        actuator.set("kp", str(info.default_gains.stiffness))
        actuator.set("ctrllimited", "true")
        actuator.set("ctrlrange", f"{low} {high}")
        if limits.effort is not None:
            actuator.set("forcelimited", "true")
            actuator.set("forcerange", f"{-limits.effort} {limits.effort}")
    return xml.tostring(model, encoding="unicode")


def _child(parent: xml.Element, tag: str) -> xml.Element:
    """Returns the first one, which is made if none exists."""
    found = parent.find(tag)
    return xml.SubElement(parent, tag) if found is None else found


def _touch(geom: xml.Element, kinds: tuple[str, str], friction: float) -> None:
    contype, conaffinity = kinds
    geom.set("contype", contype)
    geom.set("conaffinity", conaffinity)
    geom.set("friction", str(friction))
