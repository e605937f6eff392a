"""Positions and velocities that joints are set to at once."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Literal, Union

import numpy as np
import numpy.typing as npt

from simd_client import proto
from simd_client.errors import TargetBeyondLimit, refused_here
from simd_client.geometry import FloatArray, vector
from simd_client.layout import ONE_AXIS, JointInfo, JointType, Layout
from simd_client.quantity import Quantity, number
from simd_client.state import Clamped
from simd_client.target import BeyondLimit, beyond_limit_to_proto

JointValue = Union[Quantity, Sequence[float], FloatArray]
"""Value of one joint: a number or text with a unit. A spherical joint takes a quaternion x y z w, or three
numbers of a velocity."""

JointValues = Union[Mapping[str, JointValue], npt.ArrayLike]
"""Values of a robot's joints: by name, optionally with units, or as an array in joint order."""


def resets_need_layout(positions: JointValues | None, velocities: JointValues | None) -> bool:
    """Whether the values need a layout: arrays, or units, which must fit the joints. Raises `ValueError` if
    only one is by name."""
    by_name = positions is None or isinstance(positions, Mapping)
    if velocities is not None and by_name != isinstance(velocities, Mapping):
        raise ValueError("positions and velocities are both by name or both arrays")
    if positions is None or isinstance(positions, Mapping):
        given = [*(positions or {}).values(), *(velocities.values() if isinstance(velocities, Mapping) else ())]
        return any(isinstance(value, str) for value in given)
    return True


def resets_to_proto(
    layout: Layout | None, positions: JointValues | None, velocities: JointValues | None
) -> Sequence[proto.JointReset]:
    """Builds one message for each joint and axis; none for the values from the spawn."""
    if positions is None or isinstance(positions, Mapping):
        return _by_name(layout, positions or {}, velocities if isinstance(velocities, Mapping) else None)
    if layout is None:
        raise ValueError("an array of positions needs a layout")
    return _in_order(layout, positions, velocities)


def judged(
    layout: Layout, resets: Sequence[proto.JointReset], beyond_limit: BeyondLimit | Literal["keep"]
) -> list[Clamped]:
    """Clamps positions beyond a limit in these messages, and returns them. Raises `TargetBeyondLimit` if they
    are to be refused."""
    if beyond_limit == "keep":
        return []
    beyond_limit_to_proto(beyond_limit, "keep")
    clamped: list[Clamped] = []
    for reset in resets:
        joint = layout.by_name.get(reset.joint)
        if joint is None or joint.type not in ONE_AXIS or not math.isfinite(reset.position):
            continue
        low, high = joint.limits.lower, joint.limits.upper
        allowed = min(max(reset.position, -math.inf if low is None else low), math.inf if high is None else high)
        if allowed == reset.position:
            continue
        if beyond_limit == "refuse":
            raise _beyond(layout, joint, reset.position)
        clamped.append(Clamped(layout.robot, joint.name, reset.position, allowed))
        reset.position = allowed
    return clamped


def _beyond(layout: Layout, joint: JointInfo, position: float) -> TargetBeyondLimit:
    low, high = joint.limits.lower, joint.limits.upper
    span = f"{'-inf' if low is None else f'{low:g}'} to {'inf' if high is None else f'{high:g}'}"
    message = f"position {position:g} of joint `{joint.name}` of robot `{layout.robot}` is beyond its limits, {span}"
    error = refused_here(TargetBeyondLimit, "OUT_OF_RANGE", message)
    error.metadata = {"joint": joint.name, "lower": str(low), "upper": str(high)}
    return error


def _by_name(
    layout: Layout | None, positions: Mapping[str, JointValue], velocities: Mapping[str, JointValue] | None
) -> list[proto.JointReset]:
    velocities = velocities or {}
    for name in velocities:
        if name not in positions:
            raise ValueError(f"joint `{name}` is given a velocity and no position to start from")
    known: Mapping[str, JointInfo] = layout.by_name if layout else {}
    return [_one(name, at, velocities.get(name), known.get(name)) for name, at in positions.items()]


def _one(
    name: str, position: JointValue, velocity: JointValue | None, known: JointInfo | None
) -> proto.JointReset:
    if isinstance(position, (Sequence, np.ndarray)) and not isinstance(position, str):
        return _spherical(name, position, (0.0, 0.0, 0.0) if velocity is None else velocity)
    if isinstance(velocity, (Sequence, np.ndarray)) and not isinstance(velocity, str):
        raise ValueError(f"joint `{name}` is given one number as a position and several as a velocity")
    return proto.JointReset(
        joint=name,
        position=number(position, "position", known),
        velocity=number(0.0 if velocity is None else velocity, "velocity", known),
    )


def _spherical(name: str, orientation: npt.ArrayLike, velocity: npt.ArrayLike) -> proto.JointReset:
    x, y, z, w = vector(orientation, 4, f"the orientation of joint `{name}` (x y z w)").tolist()
    a, b, c = vector(velocity, 3, f"the angular velocity of joint `{name}`").tolist()
    reset = proto.SphericalReset(
        orientation=proto.Quaternion(x=x, y=y, z=z, w=w), angular_velocity=proto.Vector3(x=a, y=b, z=c)
    )
    return proto.JointReset(joint=name, spherical=reset)


def _in_order(
    layout: Layout, positions: npt.ArrayLike, velocities: JointValues | None
) -> list[proto.JointReset]:
    if isinstance(velocities, Mapping):
        raise ValueError("positions and velocities are both by name or both arrays")
    given = (0.0,) * layout.velocity_count if velocities is None else velocities
    at = vector(positions, layout.position_count, f"a position of robot `{layout.robot}`")
    moving = vector(given, layout.velocity_count, f"a velocity of robot `{layout.robot}`")
    resets: list[proto.JointReset] = []
    for joint in layout.joints:
        positions_of, velocities_of = at[joint.positions], moving[joint.velocities]
        if joint.type is JointType.SPHERICAL:
            resets.append(_spherical(joint.name, positions_of, velocities_of))
        elif joint.mimic is None and len(positions_of) == joint.dof:
            resets += [
                proto.JointReset(joint=joint.name, position=position, velocity=velocity, axis=axis)
                for axis, (position, velocity) in enumerate(zip(positions_of.tolist(), velocities_of.tolist()))
            ]
    return resets
