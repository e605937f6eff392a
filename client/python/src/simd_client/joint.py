"""One joint of a robot, and all of them by name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, TypeVar

from simd_client.geometry import FloatArray
from simd_client.layout import Gains, JointInfo, JointMode, JointType, Limits
from simd_client.plans import joints as plans
from simd_client.state import Applied, JointState
from simd_client.target import BeyondLimit, OneTarget, Target
from simd_client.world import Stamp

if TYPE_CHECKING:
    from simd_client.robot import Robot


class JointHandle:
    """What is known of a joint without asking the daemon."""

    def __init__(self, info: JointInfo, robot: str) -> None:
        self._info = info
        self._robot_name = robot

    @property
    def name(self) -> str:
        """Its name."""
        return self._info.name

    @property
    def info(self) -> JointInfo:
        """All that its robot's layout says of it, as it was fetched; see `Robot.refresh`."""
        return self._info

    @property
    def type(self) -> JointType:
        """What kind of joint it is."""
        return self._info.type

    @property
    def axis(self) -> FloatArray | None:
        """Unit vector in the joint's frame; `None` for fixed and floating joints."""
        return self._info.axis

    @property
    def limits(self) -> Limits:
        """Its limits, as they were fetched."""
        return self._info.limits

    @property
    def is_actuated(self) -> bool:
        """Whether it takes targets."""
        return self._info.is_actuated

    def __repr__(self) -> str:
        limits = self._info.limits
        low = "-inf" if limits.lower is None else f"{limits.lower:g}"
        high = "inf" if limits.upper is None else f"{limits.upper:g}"
        span = f", {low} to {high}" if self._info.freedom == 1 else ""
        return f"<Joint '{self._robot_name}/{self.name}': {self.type.name.lower()}{span}>"


Handle = TypeVar("Handle", bound=JointHandle)


class JointMap(Mapping[str, Handle]):
    """Joints by name or index."""

    def __init__(self, joints: Mapping[str, Handle], robot: str) -> None:
        self._joints = joints
        self._robot_name = robot

    def __getitem__(self, name: str | int) -> Handle:
        if isinstance(name, int):
            return list(self._joints.values())[name]
        if name not in self._joints:
            names = ", ".join(f"`{known}`" for known in self._joints)
            raise KeyError(f"robot `{self._robot_name}` has no joint `{name}`; it has {names}")
        return self._joints[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._joints)

    def __len__(self) -> int:
        return len(self._joints)

    def __repr__(self) -> str:
        return "\n".join(map(repr, self._joints.values()))


class Joint(JointHandle):
    """A joint of a robot. Radians, newton metres and seconds for joints that turn; metres, newtons and
    seconds for joints that slide. Each property that moves is one round trip: read whole robots in loops."""

    def __init__(self, robot: Robot, info: JointInfo) -> None:
        super().__init__(info, robot.name)
        self._robot = robot

    @property
    def position(self) -> float:
        """rad or m, of the newest state."""
        return self.read().position

    @property
    def velocity(self) -> float:
        """rad/s or m/s, of the newest state."""
        return self.read().velocity

    @property
    def effort(self) -> float:
        """What the actuator applied over the last step, N m or N."""
        return self.read().effort

    @property
    def mode(self) -> JointMode:
        """What the actuator does."""
        return self.read().mode

    @property
    def target(self) -> float:
        """A position, a velocity or an effort, as `mode` says."""
        return self.read().target

    @target.setter
    def target(self, target: OneTarget) -> None:
        """A position to go to, or a `Target`. Beyond a limit it is clamped."""
        self.set_target(target)

    def read(self) -> JointState:
        """All of its newest state, in one round trip."""
        return self._robot.states({self.name})[self.name]

    def set_target(self, target: OneTarget, *, beyond_limit: BeyondLimit = "clamp") -> Applied:
        """Any target; a number is a position."""
        return self._robot.set_targets({self.name: target}, beyond_limit=beyond_limit)

    def set_position(
        self,
        position: float,
        *,
        velocity: float = 0.0,
        stiffness: float | None = None,
        damping: float | None = None,
        feed_forward: float = 0.0,
        max_effort: float | None = None,
        max_velocity: float | None = None,
        beyond_limit: BeyondLimit = "clamp",
    ) -> Applied:
        """Go to a position and stay there; see `Target.position`."""
        target = Target.position(
            position,
            velocity=velocity,
            stiffness=stiffness,
            damping=damping,
            feed_forward=feed_forward,
            max_effort=max_effort,
            max_velocity=max_velocity,
        )
        return self.set_target(target, beyond_limit=beyond_limit)

    def set_velocity(
        self,
        velocity: float,
        *,
        damping: float | None = None,
        feed_forward: float = 0.0,
        max_effort: float | None = None,
        beyond_limit: BeyondLimit = "clamp",
    ) -> Applied:
        """Turn or slide at a rate; see `Target.velocity`."""
        target = Target.velocity(velocity, damping=damping, feed_forward=feed_forward, max_effort=max_effort)
        return self.set_target(target, beyond_limit=beyond_limit)

    def set_effort(self, effort: float, *, beyond_limit: BeyondLimit = "clamp") -> Applied:
        """Apply an effort until told otherwise."""
        return self.set_target(Target.effort(effort), beyond_limit=beyond_limit)

    def hold(self) -> Applied:
        """Stay where the joint is."""
        return self.set_target(Target.hold())

    def set_passive(self) -> Applied:
        """No actuator: only the joint's own damping and friction."""
        return self.set_target(Target.passive())

    def reset(self, position: float = 0.0, velocity: float = 0.0) -> Stamp:
        """Puts the joint at a position and a rate. A joint that holds its position holds the new one."""
        return self._robot.reset_joints({self.name: position}, {self.name: velocity})

    def set_properties(
        self,
        *,
        damping: float | None = None,
        friction: float | None = None,
        armature: float | None = None,
        limits: Limits | None = None,
        default_gains: Gains | None = None,
    ) -> Stamp:
        """Changes what is given and leaves the rest; `limits` replaces all four."""
        plan = plans.set_properties(
            self._robot.memory,
            self._robot.name,
            self.name,
            damping,
            friction,
            armature,
            limits,
            default_gains,
        )
        return self._robot.run(plan)


class Joints(JointMap[Joint]):
    """A robot's joints by name, in depth-first order, fixed ones included; also by index."""
