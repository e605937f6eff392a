"""One joint of a robot, for asyncio."""

from __future__ import annotations

from typing import TYPE_CHECKING

from simd_client.aio.runner import Answer
from simd_client.joint import JointHandle, JointMap
from simd_client.layout import Gains, JointInfo, JointMode, Limits
from simd_client.plans import joints as plans
from simd_client.state import Applied, JointState
from simd_client.target import BeyondLimit, OneTarget, Target
from simd_client.world import Stamp

if TYPE_CHECKING:
    from simd_client.aio.robot import Robot


class Joint(JointHandle):
    """See `simd_client.Joint`: the same names, and whatever asks the daemon is awaited, properties too:
    `await joint.position`. Set a target by `set_position` and its like."""

    def __init__(self, robot: Robot, info: JointInfo) -> None:
        super().__init__(info, robot.name)
        self._robot = robot

    @property
    async def position(self) -> float:
        """rad or m, of the newest state."""
        return (await self.read()).position

    @property
    async def velocity(self) -> float:
        """rad/s or m/s, of the newest state."""
        return (await self.read()).velocity

    @property
    async def effort(self) -> float:
        """What the actuator applied over the last step, N m or N."""
        return (await self.read()).effort

    @property
    async def mode(self) -> JointMode:
        """What the actuator does."""
        return (await self.read()).mode

    @property
    async def target(self) -> float:
        """A position, a velocity or an effort, as `mode` says."""
        return (await self.read()).target

    async def read(self) -> JointState:
        """All of its newest state, in one round trip."""
        return (await self._robot.states({self.name}))[self.name]

    def set_target(self, target: OneTarget, *, beyond_limit: BeyondLimit = "clamp") -> Answer[Applied]:
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
    ) -> Answer[Applied]:
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
    ) -> Answer[Applied]:
        """Turn or slide at a rate; see `Target.velocity`."""
        target = Target.velocity(velocity, damping=damping, feed_forward=feed_forward, max_effort=max_effort)
        return self.set_target(target, beyond_limit=beyond_limit)

    def set_effort(self, effort: float, *, beyond_limit: BeyondLimit = "clamp") -> Answer[Applied]:
        """Apply an effort until told otherwise."""
        return self.set_target(Target.effort(effort), beyond_limit=beyond_limit)

    def hold(self) -> Answer[Applied]:
        """Stay where the joint is."""
        return self.set_target(Target.hold())

    def set_passive(self) -> Answer[Applied]:
        """No actuator: only the joint's own damping and friction."""
        return self.set_target(Target.passive())

    def reset(self, position: float = 0.0, velocity: float = 0.0) -> Answer[Stamp]:
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
    ) -> Answer[Stamp]:
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
