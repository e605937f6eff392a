"""Goals of robot motions, and checks for arrival."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
import numpy.typing as npt

from simd_client.geometry import vector
from simd_client.layout import Layout
from simd_client.quantity import Quantity, number
from simd_client.state import Clamped, RobotState
from simd_client.target import Target


class Goal:
    """Goal positions of joints, each of one axis, with tolerances."""

    def __init__(self, positions: Mapping[str, float], tolerance: float, velocity_tolerance: float) -> None:
        for value in (tolerance, velocity_tolerance):
            if not value > 0.0:
                raise ValueError(f"a tolerance is above 0, not {value}")
        self._positions = dict(positions)
        self._tolerance = tolerance
        self._velocity_tolerance = velocity_tolerance

    def clamp(self, clamped: Iterable[Clamped]) -> None:
        """Positions beyond a limit become the daemon's clamped positions."""
        self._positions.update((each.joint, each.applied) for each in clamped)

    def is_reached(self, state: RobotState) -> bool:
        """Whether all joints have arrived and are at rest."""
        return all(
            abs(state[joint].position - at) <= self._tolerance
            and abs(state[joint].velocity) <= self._velocity_tolerance
            for joint, at in self._positions.items()
        )

    def missed(self, state: RobotState) -> str:
        """Returns the message of an unreached goal: the furthest joint, or the fastest one if all have
        arrived."""
        far = max(self._positions, key=lambda joint: abs(state[joint].position - self._positions[joint]))
        at, wanted = state[far].position, self._positions[far]
        if abs(at - wanted) > self._tolerance:
            blocked = next((joint for joint in state if joint.name in self._positions and joint.blocked_by), None)
            why = f"; {blocked.blocked_by} blocks joint `{blocked.name}`" if blocked else ""
            return f"joint `{far}` is at {at:.4g} and not at {wanted:.4g}{why}"
        fast = max(self._positions, key=lambda joint: abs(state[joint].velocity))
        return f"joint `{fast}` is there and still moves, at {state[fast].velocity:.3g} per second"


def moves_to(
    layout: Layout,
    positions: npt.ArrayLike | Mapping[str, Quantity],
    max_velocity: float | None,
    tolerance: float,
    velocity_tolerance: float,
) -> tuple[Goal, dict[str, Target]]:
    """Returns the goal of a motion, and its targets. Raises `ValueError` for an array of another length, and
    for a joint without exactly one position."""
    if isinstance(positions, Mapping):
        known = layout.by_name
        wanted = {name: number(at, "position", known.get(name)) for name, at in positions.items()}
    else:
        values = vector(positions, layout.position_count, f"a position of robot `{layout.robot}`").tolist()
        joints = [joint for joint in layout.moving if joint.is_actuated]
        if any(joint.dof != 1 for joint in joints):
            raise ValueError(f"robot `{layout.robot}` has joints with several axes: name the joints that move")
        wanted = {joint.name: values[joint.positions.start] for joint in joints}
    if not wanted:
        raise ValueError(f"robot `{layout.robot}` is given no joint to move")
    for name, at in wanted.items():
        joint = layout.by_name.get(name)
        if joint is not None and joint.dof != 1:
            raise ValueError(f"joint `{name}` of robot `{layout.robot}` has {joint.dof} axes and not one")
        if not np.isfinite(at):
            raise ValueError(f"a position of joint `{name}` is a number, not {at}")
    targets = {name: Target.position(at, max_velocity=max_velocity) for name, at in wanted.items()}
    return Goal(wanted, tolerance, velocity_tolerance), targets
