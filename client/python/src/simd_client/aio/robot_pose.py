"""Pose and velocity of a robot, and wrenches applied to its links."""

from __future__ import annotations

import numpy.typing as npt

from simd_client import proto
from simd_client.aio.robot_contacts import RobotContacts
from simd_client.geometry import (
    Pose,
    Twist,
    pose_from_proto,
    pose_to_proto,
    twist_from_proto,
    twist_to_proto,
    vector_to_proto,
)
from simd_client.proto import methods
from simd_client.world import Stamp, stamp_from_proto


class RobotPose(RobotContacts):
    """The part of a robot that covers its pose and the wrenches applied to it."""

    @property
    async def pose(self) -> Pose:
        """`world_from_root`."""
        return pose_from_proto((await self._entity_state()).pose)

    @property
    async def twist(self) -> Twist:
        """Velocity of the root link's origin, world axes."""
        return twist_from_proto((await self._entity_state()).twist)

    async def set_state(self, pose: Pose | None = None, twist: Twist | None = None) -> Stamp:
        """Sets the pose or the twist of the root link, or both. The twist of a fixed base must be zero."""
        request = proto.SetEntityStateRequest(
            robot=self.name,
            pose=None if pose is None else pose_to_proto(pose),
            twist=None if twist is None else twist_to_proto(twist),
        )
        return stamp_from_proto((await self._connection.call(methods.SetEntityState, request)).stamp)

    async def apply_wrench(
        self,
        link: str,
        force: npt.ArrayLike = (0, 0, 0),
        torque: npt.ArrayLike = (0, 0, 0),
        *,
        frame: str = "world",
        point: npt.ArrayLike | None = None,
        persistent: bool = False,
    ) -> Stamp:
        """Applies a force (N) at `point` (in the link's frame, metres) and a torque (N m) to a link for the
        next step. A `persistent` wrench lasts until it is replaced or cleared. `frame` selects the axes of
        force and torque: `world` or `link`."""
        frames = {"world": proto.WrenchFrame.WRENCH_FRAME_WORLD, "link": proto.WrenchFrame.WRENCH_FRAME_LINK}
        if frame not in frames:
            raise ValueError(f"frame is 'world' or 'link', not {frame!r}")
        request = proto.ApplyLinkWrenchRequest(
            robot=self.name,
            link=link,
            wrench=proto.Wrench(
                force=vector_to_proto(force, "a force"), torque=vector_to_proto(torque, "a torque")
            ),
            frame=frames[frame],
            point=None if point is None else vector_to_proto(point, "a point"),
            persistent=persistent,
        )
        return stamp_from_proto((await self._connection.call(methods.ApplyLinkWrench, request)).stamp)

    async def pull(
        self,
        link: str,
        target: npt.ArrayLike | None,
        *,
        point: npt.ArrayLike | None = None,
        stiffness: float | None = None,
        max_force: float | None = None,
        duration: float | None = None,
    ) -> Stamp:
        """Pulls `point` of a link (in the link's frame, metres; its origin by default) to `target` (world,
        metres) by a spring with a critical damper. It replaces an earlier pull on that link; `None` releases
        the link. Each step computes the force from the link's pose at that step.

        `stiffness` (N/m) and `max_force` (N) default to 60 for each kilogram of the link and its payload. The
        pull ends `duration` simulated seconds after the call, 0.5 by default; call again to continue.
        """
        request = proto.PullLinkRequest(
            robot=self.name,
            link=link,
            point=None if point is None else vector_to_proto(point, "a point"),
            target=None if target is None else vector_to_proto(target, "a target"),
            stiffness=stiffness,
            max_force=max_force,
            duration=duration,
        )
        return stamp_from_proto((await self._connection.call(methods.PullLink, request)).stamp)

    async def _entity_state(self) -> proto.GetEntityStateResponse:
        request = proto.GetEntityStateRequest(robot=self.name)
        return await self._connection.call(methods.GetEntityState, request)
