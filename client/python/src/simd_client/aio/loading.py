"""Spawns robots: from this disk, from a text, from the daemon's disk."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Literal

import numpy.typing as npt

from simd_client import proto
from simd_client.aio.connection import Connection
from simd_client.aio.robot import Robot
from simd_client.aio.runtime import LONGEST, replies
from simd_client.aio.upload import upload
from simd_client.description import LoadReport, report_from_proto, robot_info_from_proto
from simd_client.description_files import AnyPath, Packages
from simd_client.errors import AnswerError, SimdError
from simd_client.expansion import Arguments
from simd_client.geometry import Pose
from simd_client.method import decoded
from simd_client.progress import Bars, Progress
from simd_client.proto import methods
from simd_client.reset import judged
from simd_client.spawn import (
    UPRIGHT,
    Collision,
    JointPositions,
    SpawnOptions,
    srdf_bytes,
    starts_clamped,
    starts_to_proto,
)
from simd_client.surface import Surfaces
from simd_client.target import BeyondLimit


class Loading(Connection):
    """The part of a connection that spawns robots from descriptions."""

    async def load(
        self,
        path: AnyPath,
        name: str = "",
        *,
        position: npt.ArrayLike = (0, 0, 0),
        orientation: npt.ArrayLike = UPRIGHT,
        beside: bool = False,
        fixed: bool | None = None,
        passive: bool = False,
        joint_positions: JointPositions | None = None,
        beyond_limit: BeyondLimit | Literal["keep"] = "clamp",
        scale: float | None = None,
        strict: bool = False,
        allow_renaming: bool = False,
        surfaces: Surfaces | None = None,
        self_collision: bool = False,
        srdf: AnyPath | None = None,
        collision: Collision = "mesh",
        packages: Packages | None = None,
        xacro_arguments: Arguments | None = None,
        progress: Progress = False,
        model: str = "",
    ) -> Robot:
        """Loads a robot from this disk: a URDF, SDF or MJCF file, or a package folder that contains one.
        Referenced and included files are sent too; `report` has a warning for each missing file. A `.xacro`
        file is expanded first, by ROS's own package (`pip install 'xacro>=2.1,<3'`), with `xacro_arguments`.

        `model` selects one of several robots in a file. Without it all are spawned at one moment: the first
        is returned, and `robots` of the simulation has the others.

        `position` (metres) and `orientation` (x y z w) are `world_from_root`. `beside` moves the robot
        along y until it stands beside all others, and up until its shapes are above z = 0. Visuals
        of a link count if it has no collision shapes. `fixed` fixes the root link to the world; by default it is fixed if it
        is called `world`. Joints hold their position unless `passive`, and start at `joint_positions`: by joint name, where
        they may have units, or as an array in joint order. A spherical joint has a quaternion x y z w. A
        position beyond a limit is clamped and reported in `report`; with `beyond_limit="refuse"` the robot is
        refused, and with `"keep"` it starts there. `scale` multiplies lengths. `packages` are searched for ROS packages first. `surfaces` replaces
        the file's friction and restitution: one `Surface` for all links, or some by link. With
        `self_collision` its links collide with each other, except links that a joint connects and pairs in
        the `disable_collisions` of the file `srdf`. `collision` selects the use of collision meshes. `"mesh"`
        keeps the triangles of links that can never move, and gives other links their convex hulls; `"hull"`:
        hulls; `"parts"`: convex parts. `report` has the result for each. `progress` shows bars of the bytes
        sent and read: `True` on a terminal or in a notebook, or a class such as `tqdm.auto.tqdm`. The
        timeout counts the daemon's silence only: on a busy machine descriptions wait for each other.
        """
        options = SpawnOptions(
            name, allow_renaming, Pose.of(position, orientation), fixed, passive, joint_positions, scale, strict,
            surfaces, self_collision, srdf_bytes(srdf), collision, model, beyond_limit, beside,
        )  # fmt: skip
        if progress is False:
            return await self._spawn(await upload(self, path, packages, xacro_arguments), options)
        with Bars(progress) as bars:
            source = await upload(self, path, packages, xacro_arguments, bars)
            return await self._spawn_with_progress(source, options, bars, Path(path).name)

    async def load_text(
        self,
        urdf: str | bytes,
        name: str = "",
        *,
        position: npt.ArrayLike = (0, 0, 0),
        orientation: npt.ArrayLike = UPRIGHT,
        beside: bool = False,
        fixed: bool | None = None,
        passive: bool = False,
        joint_positions: JointPositions | None = None,
        beyond_limit: BeyondLimit | Literal["keep"] = "clamp",
        scale: float | None = None,
        strict: bool = False,
        allow_renaming: bool = False,
        surfaces: Surfaces | None = None,
        self_collision: bool = False,
        srdf: AnyPath | None = None,
        collision: Collision = "mesh",
    ) -> Robot:
        """Like `load`, for the text of a URDF that refers to no files."""
        options = SpawnOptions(
            name, allow_renaming, Pose.of(position, orientation), fixed, passive, joint_positions, scale, strict,
            surfaces, self_collision, srdf_bytes(srdf), collision, beyond_limit=beyond_limit, beside=beside,
        )  # fmt: skip
        source = proto.DescriptionSource(urdf=urdf.encode() if isinstance(urdf, str) else urdf)
        return await self._spawn(source, options)

    async def load_on_daemon(
        self,
        path: str,
        name: str = "",
        *,
        position: npt.ArrayLike = (0, 0, 0),
        orientation: npt.ArrayLike = UPRIGHT,
        beside: bool = False,
        fixed: bool | None = None,
        passive: bool = False,
        joint_positions: JointPositions | None = None,
        beyond_limit: BeyondLimit | Literal["keep"] = "clamp",
        scale: float | None = None,
        strict: bool = False,
        allow_renaming: bool = False,
        surfaces: Surfaces | None = None,
        self_collision: bool = False,
        srdf: AnyPath | None = None,
        collision: Collision = "mesh",
    ) -> Robot:
        """Like `load`, for a path on the daemon's disk, below one of its asset roots."""
        options = SpawnOptions(
            name, allow_renaming, Pose.of(position, orientation), fixed, passive, joint_positions, scale, strict,
            surfaces, self_collision, srdf_bytes(srdf), collision, beyond_limit=beyond_limit, beside=beside,
        )  # fmt: skip
        return await self._spawn(proto.DescriptionSource(path=path), options)

    async def validate(
        self,
        path: AnyPath,
        *,
        model: str = "",
        scale: float | None = None,
        packages: Packages | None = None,
        xacro_arguments: Arguments | None = None,
    ) -> LoadReport:
        """Reads a file on this disk as `load` does, without spawning a robot. Returns the report.

        `model` names one robot of an SDF or MJCF with several; empty means all of them.
        """
        source = await upload(self, path, packages, xacro_arguments)
        request = proto.ValidateDescriptionRequest(source=source, scale=scale, model=model)
        answer = await self.call_until_silent(methods.ValidateDescription, request)
        return report_from_proto(answer.report)

    async def _spawn(self, source: proto.DescriptionSource, options: SpawnOptions) -> Robot:
        request = options.to_proto(source)
        return await self._spawned(await self.call_until_silent(methods.SpawnEntity, request), options)

    async def _spawn_with_progress(
        self, source: proto.DescriptionSource, options: SpawnOptions, bars: Bars, name: str
    ) -> Robot:
        request = proto.SpawnEntityWithProgressRequest(spawn=options.to_proto(source))
        method = methods.SpawnEntityWithProgress
        sent = request.SerializeToString()
        async for payload in replies(self._link, method, sent, LONGEST, self._timeout, self.alive):
            answer = decoded(method.reply, payload)
            if answer.HasField("spawned"):
                return await self._spawned(answer.spawned, options)
            far = answer.progress
            phase = proto.LoadPhase.Name(far.phase).removeprefix("LOAD_PHASE_").lower()
            bars.reach(f"{name}: {phase}", far.done, far.total, "files")
        raise AnswerError("the daemon's answer cannot be understood: the stream ended before the robot was there")

    async def _spawned(self, answer: proto.SpawnEntityResponse, options: SpawnOptions) -> Robot:
        info = robot_info_from_proto(answer.entity)
        await self.fetch_layout(info.name)
        report = report_from_proto(answer.report)
        if options.joint_positions is not None:
            report = await self._started(info.name, options, report)
        return Robot(self, info, report)

    async def _started(self, name: str, options: SpawnOptions, report: LoadReport) -> LoadReport:
        """Sets joints to the positions of an array, and clamps initial positions beyond limits. A robot with
        a refused initial position is removed."""
        layout = await self.layout(name)
        try:
            resets = starts_to_proto(layout, options.joint_positions)
            clamped = judged(layout, resets, options.beyond_limit)
            if clamped or not isinstance(options.joint_positions, Mapping):
                request = proto.ResetJointsRequest(robots=[proto.RobotReset(robot=name, joints=resets)])
                await self.call(methods.ResetJoints, request)
        except (SimdError, ValueError):
            await self.call(methods.DeleteEntity, proto.DeleteEntityRequest(robot=name))
            self._cache.mark_stale(name)
            raise
        return report.with_findings(starts_clamped(clamped))
