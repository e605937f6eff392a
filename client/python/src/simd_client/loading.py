"""Bringing robots into a world: from this disk, from a text, from the daemon's disk."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Generic, TypeVar

import numpy.typing as npt

from simd_client.geometry import Pose
from simd_client.memory import Memory
from simd_client.plan import Plan
from simd_client.plans import robots
from simd_client.plans.robots import AnyPath, Loaded, Options, Packages
from simd_client.proto import DescriptionSource
from simd_client.surface import Surfaces

Made = TypeVar("Made")
"""A robot, or what is awaited for one."""


class Loading(ABC, Generic[Made]):
    """The part of a connection that brings descriptions in; the same for blocking and for asyncio code."""

    _memory: Memory

    @abstractmethod
    def _loaded(self, plan: Plan[Loaded]) -> Made:
        """The robot that a plan brings."""

    def load(
        self,
        path: AnyPath,
        name: str = "",
        *,
        position: npt.ArrayLike = (0, 0, 0),
        orientation: npt.ArrayLike = (0, 0, 0, 1),
        fixed: bool | None = None,
        passive: bool = False,
        joint_positions: Mapping[str, float] | None = None,
        scale: float | None = None,
        strict: bool = False,
        allow_renaming: bool = False,
        surfaces: Surfaces | None = None,
        self_collision: bool = False,
        packages: Packages | None = None,
    ) -> Made:
        """Sends a robot from this disk and brings it into the world: a URDF file, or a package folder that
        holds one. The files that it names are sent, too; those that are not found are warnings in `report`.

        `position` (metres) and `orientation` (x y z w) are `world_from_root`. `fixed` bolts the root link to the
        world; left out, it is fixed where it is called `world`. Joints hold their position unless `passive`.
        `scale` multiplies lengths. `packages` says where ROS packages are, before any search.
        `surfaces` are one `Surface` for all links, or some by link, in the place of the file's; with
        `self_collision` its links touch each other, too, except those that a joint connects.
        """
        pose = Pose.of(position, orientation)
        options = Options(
            name,
            allow_renaming,
            pose,
            fixed,
            passive,
            joint_positions,
            scale,
            strict,
            surfaces,
            self_collision,
        )
        return self._loaded(robots.load(self._memory, path, packages, options))

    def load_text(
        self,
        urdf: str | bytes,
        name: str = "",
        *,
        position: npt.ArrayLike = (0, 0, 0),
        orientation: npt.ArrayLike = (0, 0, 0, 1),
        fixed: bool | None = None,
        passive: bool = False,
        joint_positions: Mapping[str, float] | None = None,
        scale: float | None = None,
        strict: bool = False,
        allow_renaming: bool = False,
        surfaces: Surfaces | None = None,
        self_collision: bool = False,
    ) -> Made:
        """The same for the text of a URDF that names no files."""
        pose = Pose.of(position, orientation)
        options = Options(
            name,
            allow_renaming,
            pose,
            fixed,
            passive,
            joint_positions,
            scale,
            strict,
            surfaces,
            self_collision,
        )
        return self._loaded(robots.spawn(self._memory, robots.text_source(urdf), options))

    def load_on_daemon(
        self,
        path: str,
        name: str = "",
        *,
        position: npt.ArrayLike = (0, 0, 0),
        orientation: npt.ArrayLike = (0, 0, 0, 1),
        fixed: bool | None = None,
        passive: bool = False,
        joint_positions: Mapping[str, float] | None = None,
        scale: float | None = None,
        strict: bool = False,
        allow_renaming: bool = False,
        surfaces: Surfaces | None = None,
        self_collision: bool = False,
    ) -> Made:
        """The same for a path on the daemon's own disk, below one of its asset roots."""
        pose = Pose.of(position, orientation)
        options = Options(
            name,
            allow_renaming,
            pose,
            fixed,
            passive,
            joint_positions,
            scale,
            strict,
            surfaces,
            self_collision,
        )
        return self._loaded(robots.spawn(self._memory, DescriptionSource(path=path), options))
