# Generated from simd_client/aio/joint.py by tools/make_blocking.py; do not edit.
"""One joint of a robot, and all of them by name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Literal

from simd_client.attributes import FixedAttributes
from simd_client.errors import JointNotFound, listed, not_found
from simd_client.geometry import FloatArray
from simd_client.layout import Gains, JointInfo, JointLimits, JointMode, JointSpring, JointType
from simd_client.quantity import Quantity, number
from simd_client.reset import JointValue
from simd_client.state import Applied, JointState
from simd_client.target import BeyondLimit, OneTarget, Target
from simd_client.world import Stamp

if TYPE_CHECKING:
    from simd_client.blocking.robot import Robot


class Joint(FixedAttributes):
    """A joint of a robot. Units are radians, newton metres and seconds for rotating joints; metres, newtons
    and seconds for sliding joints. Each property that changes is one round trip: in loops, read the whole
    robot."""

    def __init__(self, robot: Robot, info: JointInfo) -> None:
        self._robot = robot
        self._info = info

    @property
    def name(self) -> str:
        """The joint's name."""
        return self._info.name

    @property
    def robot_name(self) -> str:
        """The name of its robot."""
        return self._robot.name

    @property
    def info(self) -> JointInfo:
        """All properties of the joint, as fetched; see `Robot.refresh`."""
        return self._info

    @property
    def type(self) -> JointType:
        """Kind of joint."""
        return self._info.type

    @property
    def axis(self) -> FloatArray | None:
        """Unit vector in the joint's frame; `None` for fixed, floating and spherical joints."""
        return self._info.axis

    @property
    def limits(self) -> JointLimits:
        """Limits of the joint, as fetched."""
        return self._info.limits

    @property
    def is_actuated(self) -> bool:
        """Whether the joint takes targets."""
        return self._info.is_actuated

    @property
    def position(self) -> float:
        """Position in rad or m, of the newest state."""
        return self.read().position

    @property
    def velocity(self) -> float:
        """Velocity in rad/s or m/s, of the newest state."""
        return self.read().velocity

    @property
    def effort(self) -> float:
        """Effort that the actuator applied over the last step, N m or N."""
        return self.read().effort

    @property
    def mode(self) -> JointMode:
        """Mode of the actuator."""
        return self.read().mode

    @property
    def target(self) -> float:
        """Target position, velocity or effort, depending on `mode`."""
        return self.read().target

    @target.setter
    def target(self, target: OneTarget) -> None:
        """A position, or a `Target`. A target beyond a limit is clamped."""
        self.set_target(target)

    def read(self) -> JointState:
        """Returns its whole newest state, in one round trip."""
        return self._robot.states({self.name})[self.name]

    def set_target(self, target: OneTarget, *, beyond_limit: BeyondLimit = "clamp") -> Applied:
        """Sets any target; a number is a position."""
        return self._robot.set_targets({self.name: target}, beyond_limit=beyond_limit)

    def set_position(
        self,
        position: Quantity,
        *,
        velocity: Quantity = 0.0,
        stiffness: float | None = None,
        damping: float | None = None,
        feed_forward: float = 0.0,
        max_effort: float | None = None,
        max_velocity: float | None = None,
        beyond_limit: BeyondLimit = "clamp",
    ) -> Applied:
        """Moves to a position and stays there; see `Target.position`."""
        target = Target.position(
            number(position, "position", self._info),
            velocity=number(velocity, "velocity", self._info),
            stiffness=stiffness,
            damping=damping,
            feed_forward=feed_forward,
            max_effort=max_effort,
            max_velocity=max_velocity,
        )
        return self.set_target(target, beyond_limit=beyond_limit)

    def set_velocity(
        self,
        velocity: Quantity,
        *,
        damping: float | None = None,
        feed_forward: float = 0.0,
        max_effort: float | None = None,
        beyond_limit: BeyondLimit = "clamp",
    ) -> Applied:
        """Moves at a velocity; see `Target.velocity`."""
        speed = number(velocity, "velocity", self._info)
        target = Target.velocity(speed, damping=damping, feed_forward=feed_forward, max_effort=max_effort)
        return self.set_target(target, beyond_limit=beyond_limit)

    def set_effort(self, effort: Quantity, *, beyond_limit: BeyondLimit = "clamp") -> Applied:
        """Applies an effort until the next target."""
        return self.set_target(Target.effort(number(effort, "effort", self._info)), beyond_limit=beyond_limit)

    def hold(self) -> Applied:
        """Holds the current position."""
        return self.set_target(Target.hold())

    def set_passive(self) -> Applied:
        """Switches the actuator off: only the joint's damping and friction remain."""
        return self.set_target(Target.passive())

    def reset(
        self,
        position: JointValue = 0.0,
        velocity: JointValue | None = None,
        *,
        beyond_limit: BeyondLimit | Literal["keep"] = "clamp",
    ) -> Applied:
        """Sets the position and velocity of the joint; see `Robot.reset_joints`. A joint that holds its position holds the new one.

        The position of a spherical joint is a quaternion x y z w, and its velocity has three numbers.
        """
        moving = None if velocity is None else {self.name: velocity}
        return self._robot.reset_joints({self.name: position}, moving, beyond_limit=beyond_limit)

    def set_properties(
        self,
        *,
        damping: float | None = None,
        friction: float | None = None,
        armature: float | None = None,
        spring: JointSpring | None = None,
        limits: JointLimits | None = None,
        default_gains: Gains | None = None,
        gravity_compensation: bool | None = None,
        profile: bool | None = None,
    ) -> Stamp:
        """Changes only the given properties; `limits` replaces all four limits.

        With `gravity_compensation` the actuator adds the effort that holds the weight of the links below the
        joint to position, velocity and hold targets. It counts the robot's masses, not its payload. A
        `spring` acts in addition to the actuator, also without a target and beyond the effort limit. Only a joint of
        one axis can have one. With `profile` the setpoint of position targets accelerates and brakes with half
        of the effort limit; without it a target acts at once.
        """
        return self._robot.set_joint_properties(
            self.name,
            damping=damping,
            friction=friction,
            armature=armature,
            spring=spring,
            limits=limits,
            default_gains=default_gains,
            gravity_compensation=gravity_compensation,
            profile=profile,
        )

    def __repr__(self) -> str:
        limits = self._info.limits
        low = "-inf" if limits.lower is None else f"{limits.lower:g}"
        high = "inf" if limits.upper is None else f"{limits.upper:g}"
        span = f", {low} to {high}" if self._info.dof == 1 else ""
        return f"<Joint '{self._robot.name}/{self.name}': {self.type.name.lower()}{span}>"


class Joints(FixedAttributes, Mapping[str, Joint]):
    """A robot's joints by name, in depth-first order, fixed ones included; also by index."""

    def __init__(self, joints: Mapping[str, Joint], robot: str) -> None:
        self._joints = joints
        self._robot_name = robot

    def __getitem__(self, name: str | int) -> Joint:
        if isinstance(name, int):
            names = list(self._joints)
            if not -len(names) <= name < len(names):
                message = f"robot `{self._robot_name}` has {len(names)} joints, and none with the index {name}: {listed(names)}"
                raise IndexError(message)
            return self._joints[names[name]]
        if name not in self._joints:
            message = f"robot `{self._robot_name}` has no joint `{name}`; it has {listed(self._joints, name)}"
            raise not_found(JointNotFound, message, robot=self._robot_name, joint=name)
        return self._joints[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._joints)

    def __len__(self) -> int:
        return len(self._joints)

    def __repr__(self) -> str:
        return "\n".join(map(repr, self._joints.values()))
