"""Joint states: arrays of whole robots, and single joints by name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from simd_client import proto
from simd_client.attributes import FixedAttributes
from simd_client.contact import Contact
from simd_client.errors import AnswerError, JointNotFound, LayoutChanged, RobotNotFound, listed, not_found
from simd_client.geometry import FloatArray
from simd_client.layout import JointFlag, JointInfo, JointMode, Layout
from simd_client.link_states import LinkStates
from simd_client.measurement import SensorReading
from simd_client.table import Table
from simd_client.world import Stamp


class Named(Protocol):
    """A robot, or any object with a robot's name."""

    @property
    def name(self) -> str:
        """The robot's name in the world."""
        ...


def name_of(robot: str | Named) -> str:
    """A robot's name."""
    return robot if isinstance(robot, str) else robot.name


@dataclass(frozen=True)
class Obstruction:
    """A link that blocks a driven joint's motion to its target by touching the joint's links."""

    robot: str
    """Robot of the blocking link; it may be the joint's own robot."""
    link: str
    """Blocking link of that robot; empty if it has only one."""
    own_link: str
    """Link that is blocked."""
    effort: float
    """Effort of the contact forces at the joint, N m or N."""

    def __str__(self) -> str:
        return f"`{self.robot}`" if not self.link else f"link `{self.link}` of `{self.robot}`"


@dataclass(frozen=True)
class JointState:
    """State of one joint. Arrays have one entry for revolute, continuous and prismatic joints, none for fixed
    ones, three for planar ones. A floating joint has seven positions and six velocities. A spherical joint
    has a quaternion x y z w; its velocities, efforts and targets are in the child's axes. A target
    orientation is a rotation vector."""

    name: str
    positions: FloatArray
    """rad or m."""
    velocities: FloatArray
    """rad/s or m/s."""
    efforts: FloatArray
    """Effort that the actuator applied over the last step, N m or N."""
    targets: FloatArray
    """Target position, velocity or effort, depending on `mode`; 0 when passive."""
    modes: tuple[JointMode, ...]
    flags: JointFlag
    """Flags of all axes together."""
    blocked_by: Obstruction | None = None
    """Link that blocks it; `None` if nothing touches its links, or it reaches its target."""

    @property
    def position(self) -> float:
        """Position, rad or m. Raises `ValueError` unless the joint has exactly one."""
        return self._only(self.positions)

    @property
    def velocity(self) -> float:
        """Velocity, rad/s or m/s. Raises `ValueError` unless the joint has exactly one."""
        return self._only(self.velocities)

    @property
    def effort(self) -> float:
        """Effort, N m or N. Raises `ValueError` unless the joint has exactly one."""
        return self._only(self.efforts)

    @property
    def target(self) -> float:
        """Target, depending on `mode`. Raises `ValueError` unless the joint has exactly one."""
        return self._only(self.targets)

    @property
    def mode(self) -> JointMode:
        """Mode of the first axis; `NONE` for a fixed joint."""
        return self.modes[0] if self.modes else JointMode.NONE

    def _only(self, values: FloatArray) -> float:
        if len(values) != 1:
            raise ValueError(f"joint `{self.name}` has {len(values)} values and not one; read its arrays")
        return float(values[0])


class RobotState(FixedAttributes):
    """State of one robot's joints, or of its selected joints, at one moment.

    Arrays are in joint order, or in the order of the selection. They are created on first use.
    """

    _message: proto.RobotJointStates
    sensors: Mapping[str, SensorReading[Any]]
    """Newest reading of each requested sensor that has one, by name. Each has a separate stamp."""
    stamp: Stamp
    layout: Layout
    """Layout of the whole robot. It may be newer than the arrays if the robot was reloaded."""
    selected: tuple[str, ...]
    """The selected joints; empty for all of them."""

    def __init__(
        self,
        message: proto.RobotJointStates,
        stamp: Stamp,
        layout: Layout,
        selected: Sequence[str] = (),
        sensors: Mapping[str, SensorReading[Any]] | None = None,
    ) -> None:
        # Without the check of each assignment: every answer of a loop makes one of these.
        self.__dict__.update(
            _message=message,
            sensors={} if sensors is None else sensors,
            stamp=stamp,
            layout=layout,
            selected=tuple(selected),
        )

    @property
    def robot(self) -> str:
        """The robot's name."""
        return self._message.robot

    @property
    def layout_version(self) -> int:
        """Names of the joints in the arrays."""
        return self._message.layout_version

    @cached_property
    def position(self) -> FloatArray:
        """rad or m."""
        return _array(self._message.position)

    @cached_property
    def velocity(self) -> FloatArray:
        """rad/s or m/s."""
        return _array(self._message.velocity)

    @cached_property
    def effort(self) -> FloatArray:
        """Efforts that the actuators applied over the last step, N m or N."""
        return _array(self._message.effort)

    @cached_property
    def target(self) -> FloatArray:
        """Target positions, velocities or efforts, depending on `mode`; 0 when passive."""
        return _array(self._message.target)

    @cached_property
    def mode(self) -> npt.NDArray[np.int8]:
        """`JointMode` of each."""
        return np.array(self._message.mode[:], dtype=np.int8)

    @cached_property
    def flags(self) -> npt.NDArray[np.uint32]:
        """Bit sets of `JointFlag`."""
        return np.array(self._message.flags[:], dtype=np.uint32)

    @property
    def name(self) -> str:
        """The robot's name."""
        return self.robot

    def __getitem__(self, joint: str) -> JointState:
        """Returns one joint's state. Raises `JointNotFound`, also for a joint that was not selected."""
        info, positions, velocities = self._slices(joint)
        return JointState(
            name=info.name,
            positions=self.position[positions],
            velocities=self.velocity[velocities],
            efforts=self.effort[velocities],
            targets=self.target[velocities],
            modes=tuple(JointMode(int(mode)) for mode in self.mode[velocities]),
            flags=_together(self.flags[velocities]),
            blocked_by=self._obstructions.get(joint),
        )

    @cached_property
    def _obstructions(self) -> dict[str, Obstruction]:
        return {
            of.joint: Obstruction(of.by_robot, of.by_link, of.link, of.effort) for of in self._message.obstructions
        }

    def __iter__(self) -> Iterator[JointState]:
        names = self.selected or tuple(joint.name for joint in self.layout.joints)
        return (self[name] for name in names)

    def _slices(self, joint: str) -> tuple[JointInfo, slice, slice]:
        if self.layout_version != self.layout.version:
            raise layout_changed(self.robot)
        info = self.layout.by_name.get(joint)
        if info is None or (self.selected and joint not in self.selected):
            there = self.selected or self.layout.by_name
            message = f"the state of robot `{self.robot}` has no joint `{joint}`; it has {listed(there, joint)}"
            raise not_found(JointNotFound, message, robot=self.robot, joint=joint)
        if not self.selected:
            return info, info.positions, info.velocities
        position = velocity = 0
        for name in self.selected:
            if name == joint:
                break
            before = self.layout.by_name[name]
            position += before.positions.stop - before.positions.start
            velocity += before.dof
        count = info.positions.stop - info.positions.start
        return info, slice(position, position + count), slice(velocity, velocity + info.dof)

    def table(self) -> Table:
        """One row per joint."""
        rows = [
            (
                joint.name,
                self.layout.by_name[joint.name].type.name.lower(),
                joint.mode.name.lower(),
                _numbers(joint.positions),
                _numbers(joint.velocities),
                _numbers(joint.efforts),
                _numbers(joint.targets),
            )
            for joint in self
            if len(joint.positions)
        ]
        return Table(("joint", "type", "mode", "position", "velocity", "effort", "target"), rows)

    def _title(self) -> str:
        return f"{self.robot} at {self.stamp.sim_time:.6g} s"

    def __repr__(self) -> str:
        if self.layout_version != self.layout.version:
            return f"<RobotState {self._title()}, of a former layout>"
        return f"<RobotState {self._title()}>\n{self.table().text()}"

    def _repr_html_(self) -> str:
        return self.table().html(self._title())


@dataclass(frozen=True)
class Clamped:
    """A target that was beyond a limit and was clamped to it."""

    robot: str
    joint: str
    requested: float
    applied: float


@dataclass(frozen=True)
class Applied:
    """Targets that the daemon has set."""

    stamp: Stamp
    """The moment at which they were set; the next step is the first with them."""
    clamped: tuple[Clamped, ...] = ()
    """Targets that were beyond a limit."""


@dataclass(frozen=True, eq=False)
class States(Mapping[str, RobotState]):
    """States of robots by their names, all of one moment."""

    stamp: Stamp
    robots: Mapping[str, RobotState] = field(default_factory=dict[str, RobotState])
    clamped: tuple[Clamped, ...] = ()
    """Targets of the call that were beyond a limit."""
    links: Mapping[str, LinkStates] = field(default_factory=dict[str, LinkStates])
    """States of the same robots, if the call requested a step for them."""
    contacts: tuple[Contact, ...] = ()
    """Contact points of these robots, if the call requested a step for them."""

    def __getitem__(self, robot: str | Named) -> RobotState:
        name = name_of(robot)
        if name not in self.robots:
            message = f"there is no robot `{name}` in these states; there are {listed(self.robots, name)}"
            raise not_found(RobotNotFound, message, robot=name)
        return self.robots[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.robots)

    def __len__(self) -> int:
        return len(self.robots)


def layout_changed(robot: str) -> LayoutChanged:
    """Returns the error for arrays of one layout and names of another."""
    error = LayoutChanged(f"the joints of robot `{robot}` are no longer those of the layout that was fetched")
    error.code, error.reason, error.metadata = "ABORTED", "LAYOUT_CHANGED", {"robot": robot}
    return error


def robot_state(
    message: proto.RobotJointStates,
    stamp: Stamp,
    layout: Layout,
    selected: Sequence[str] = (),
    sensors: Mapping[str, SensorReading[Any]] | None = None,
) -> RobotState:
    """Converts one robot's arrays from their message."""
    if not selected and layout.version == message.layout_version:
        arrays = (message.velocity, message.effort, message.target, message.mode, message.flags)
        if len(message.position) != layout.position_count or any(
            len(array) != layout.velocity_count for array in arrays
        ):
            raise AnswerError(f"the joint states of `{message.robot}` do not have the length of its layout")
    return RobotState(message, stamp, layout, selected, sensors)


def clamped_from_proto(messages: Sequence[proto.ClampedTarget]) -> tuple[Clamped, ...]:
    """Converts clamped targets from their messages."""
    return tuple(Clamped(each.robot, each.joint, each.requested, each.applied) for each in messages)


def _array(values: Sequence[float]) -> FloatArray:
    # Reading a list is twice as fast as reading the field itself.
    return np.array(values[:], dtype=np.float64)


def _together(flags: npt.NDArray[np.uint32]) -> JointFlag:
    together = JointFlag(0)
    for each in flags.tolist():
        # Bits that only a newer daemon knows are ignored.
        together |= JointFlag(int(each) & 7)
    return together


def _numbers(values: FloatArray) -> str:
    return " ".join(f"{value:.4f}" for value in values)
