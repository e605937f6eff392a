"""Trajectories of joints: requests, and how they ended."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Optional, Union

import numpy as np
import numpy.typing as npt

from simd_client import proto
from simd_client.event import Event
from simd_client.geometry import FloatArray
from simd_client.world import Stamp

Tolerance = Optional[Union[float, Mapping[str, float]]]
"""Maximum deviation of joints from their path, in rad or m: one number for all, or by name; `None` means no
limit."""


class TrajectoryOutcome(Enum):
    """How a trajectory ended."""

    UNKNOWN = 0
    """Ended in a way that only a newer client knows."""
    SUCCEEDED = 1
    """The joints reached the goal."""
    PATH_TOLERANCE_VIOLATED = 2
    """A joint left the path."""
    GOAL_TOLERANCE_VIOLATED = 3
    """A joint did not reach the goal in time."""
    CANCELLED = 4
    """Ended by a request, a reset, the end of a claim and the like."""
    SUPERSEDED = 5
    """Another trajectory, or another target, took a joint."""


class TrajectoryStatus(Enum):
    """State of a trajectory."""

    UNKNOWN = 0
    """A state that only a newer client knows."""
    ACTIVE = 1
    """Its joints follow it."""
    QUEUED = 2
    """It begins when its predecessors have succeeded."""
    DELAYED = 3
    """It begins after its delay."""


@dataclass(frozen=True)
class TrajectoryProgress:
    """A trajectory that runs or waits."""

    id: int
    joints: tuple[str, ...]
    status: TrajectoryStatus
    elapsed: float
    """Simulated seconds since it began; more than `duration` while joints settle at the goal."""
    duration: float
    """Simulated seconds from its beginning to its last point."""
    delay: float
    """Simulated seconds until it begins, if it is delayed."""
    desired: FloatArray
    """Desired positions of the joints, rad or m; empty unless it is active."""
    actual: FloatArray
    """Actual positions of the joints."""


def progress_from_proto(message: proto.Trajectory) -> TrajectoryProgress:
    """Converts a trajectory from its message."""
    known = message.status in {status.value for status in TrajectoryStatus}
    return TrajectoryProgress(
        id=message.id,
        joints=tuple(message.joints),
        status=TrajectoryStatus(message.status if known else 0),
        elapsed=message.elapsed,
        duration=message.duration,
        delay=message.delay,
        desired=np.array(message.desired),
        actual=np.array(message.actual),
    )


@dataclass(frozen=True)
class TrajectoryResult:
    """The end of a trajectory."""

    outcome: TrajectoryOutcome
    message: str
    """Joint and deviation that ended it."""
    stamp: Stamp

    @property
    def succeeded(self) -> bool:
        """Whether the joints reached the goal."""
        return self.outcome is TrajectoryOutcome.SUCCEEDED


def result_of(event: Event, robot: str, id: int) -> TrajectoryResult | None:
    """Returns a trajectory's result from an event, if the event is its end."""
    ended = event.detail
    if event.kind != "trajectory_ended" or (ended.robot, ended.id) != (robot, id):
        return None
    known = ended.outcome in {outcome.value for outcome in TrajectoryOutcome}
    outcome = TrajectoryOutcome(ended.outcome if known else 0)
    return TrajectoryResult(outcome, ended.message, event.stamp)


def points_to_proto(
    joints: Sequence[str],
    times: npt.ArrayLike,
    positions: npt.ArrayLike,
    velocities: npt.ArrayLike | None,
    accelerations: npt.ArrayLike | None,
    efforts: npt.ArrayLike | None,
) -> list[proto.TrajectoryPoint]:
    """Builds one message for each time. Raises `ValueError` if a shape does not fit."""
    at = np.asarray(times, dtype=np.float64)
    if at.ndim != 1:
        raise ValueError(f"times have the shape {at.shape}; they are a list")

    def matrix(name: str, values: npt.ArrayLike | None) -> FloatArray | None:
        if values is None:
            return None
        array = np.asarray(values, dtype=np.float64)
        if array.shape != (len(at), len(joints)):
            raise ValueError(f"{name} have the shape {array.shape}; {len(at)} times and {len(joints)} joints need rows of them")
        return array

    given = {
        "positions": matrix("positions", positions),
        "velocities": matrix("velocities", velocities),
        "accelerations": matrix("accelerations", accelerations),
        "efforts": matrix("efforts", efforts),
    }
    arrays = {name: values for name, values in given.items() if values is not None}
    return [
        proto.TrajectoryPoint(time=time, **{name: values[row].tolist() for name, values in arrays.items()})
        for row, time in enumerate(at.tolist())
    ]


def tolerances_to_proto(joints: Sequence[str], tolerance: Tolerance) -> list[proto.TrajectoryTolerance]:
    """Builds one message for each joint that has a tolerance."""
    if tolerance is None:
        return []
    if isinstance(tolerance, Mapping):
        return [proto.TrajectoryTolerance(joint=joint, position=value) for joint, value in tolerance.items()]
    return [proto.TrajectoryTolerance(joint=joint, position=tolerance) for joint in joints]
