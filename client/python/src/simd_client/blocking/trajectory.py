# Generated from simd_client/aio/trajectory.py by tools/make_blocking.py; do not edit.
"""A trajectory that joints execute."""

from __future__ import annotations

import time

from simd_client import proto
from simd_client.blocking.connection import Connection
from simd_client.blocking.watch import EventWatch
from simd_client.attributes import FixedAttributes
from simd_client.errors import DeadlineExceeded
from simd_client.proto import methods
from simd_client.trajectory import TrajectoryProgress, TrajectoryResult, progress_from_proto, result_of
from simd_client.world import Stamp, stamp_from_proto


class Trajectory(FixedAttributes):
    """An accepted trajectory. The daemon executes it, even if this object is dropped."""

    robot: str
    """Name of its robot."""
    id: int
    """Number that the daemon gave it."""

    def __init__(self, connection: Connection, robot: str, id: int, events: EventWatch) -> None:
        self._connection = connection
        self._events = events
        self._result: TrajectoryResult | None = None
        self.robot = robot
        self.id = id

    def wait(self, timeout: float | None = None) -> TrajectoryResult:
        """Returns its result once it has ended. Raises `DeadlineExceeded` if that takes longer than `timeout`
        wall seconds."""
        begin = time.monotonic()
        while self._result is None:
            left = None if timeout is None else begin + timeout - time.monotonic()
            if left is not None and left <= 0:
                raise DeadlineExceeded(f"the trajectory did not end within {timeout:g} s")
            self._result = result_of(self._events.wait(left), self.robot, self.id)
        return self._result

    def progress(self) -> TrajectoryProgress | None:
        """Returns its progress; `None` once it has ended."""
        answer = self._connection.call(
            methods.ListTrajectories, proto.ListTrajectoriesRequest(robot=self.robot)
        )
        mine = (each for each in answer.trajectories if each.id == self.id)
        return next((progress_from_proto(each) for each in mine), None)

    def cancel(self) -> Stamp:
        """Ends the trajectory. Its joints hold where they are. Raises `InvalidValue` if it has ended
        already."""
        request = proto.CancelTrajectoryRequest(robot=self.robot, id=self.id)
        return stamp_from_proto(self._connection.call(methods.CancelTrajectory, request).stamp)

    def __repr__(self) -> str:
        return f"<Trajectory {self.id} of {self.robot!r}>"
