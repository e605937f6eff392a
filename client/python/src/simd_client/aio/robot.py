"""A robot in the world, for asyncio."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, TypeVar

import numpy.typing as npt

from simd_client import proto
from simd_client.aio.claim import Claim
from simd_client.aio.joint import Joint, Joints
from simd_client.aio.runner import Answer
from simd_client.aio.watch import Watch
from simd_client.description import LoadReport, RobotInfo
from simd_client.geometry import FloatArray, Pose, Twist
from simd_client.layout import Layout
from simd_client.link_states import LinkStates
from simd_client.plan import Plan
from simd_client.plans import contacts, joints, kinematics, robots
from simd_client.plans.contacts import Contact
from simd_client.plans.kinematics import Configuration, InverseKinematics, Jacobian, JointReactions
from simd_client.plans.robots import AnyPath, Packages, Reloaded
from simd_client.robot import RobotHandle, state_source
from simd_client.state import Applied, RobotState
from simd_client.surface import Surface
from simd_client.target import BeyondLimit, RobotTargets, Whole
from simd_client.world import Stamp

if TYPE_CHECKING:
    from simd_client.aio.simulation import Simulation

Result = TypeVar("Result")


class Robot(RobotHandle):
    """See `simd_client.Robot`: the same names, and whatever asks the daemon is awaited, properties too:
    `await robot.position`."""

    def __init__(self, simulation: Simulation, info: RobotInfo, report: LoadReport | None = None) -> None:
        super().__init__(simulation.memory, info, report)
        self._simulation = simulation
        self._cached: tuple[Layout, Joints] | None = None

    def run(self, plan: Plan[Result]) -> Answer[Result]:
        """Does what a plan says."""
        return self._simulation.run(plan)

    @property
    def layout(self) -> Layout:
        """Its joints, and where each has its values in the arrays, as it was fetched last; see `refresh`."""
        known = self._memory.layout(self.name)
        if known is None:
            raise RuntimeError(f"the layout of robot `{self.name}` was never fetched")
        return known

    def refresh(self) -> Answer[Layout]:
        """Fetches the layout again, for what others changed: limits, gains, claims."""
        return self.run(joints.fetch_layout(self._memory, self.name))

    @property
    def joints(self) -> Joints:
        """Its joints by name or index, fixed ones included."""
        layout = self.layout
        if self._cached is None or self._cached[0] is not layout:
            found = {info.name: Joint(self, info) for info in layout.joints}
            self._cached = layout, Joints(found, self.name)
        return self._cached[1]

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Those that move, in order."""
        return tuple(joint.name for joint in self.layout.moving)

    # What it does.

    def read(self) -> Answer[RobotState]:
        """Positions, velocities, efforts, targets and modes of one moment."""
        return self.run(joints.robot_state_now(self._memory, self.name))

    async def states(self, names: Iterable[str]) -> RobotState:
        """The same of some joints."""
        return (await self.run(joints.states(self._memory, {self.name: tuple(names)})))[self.name]

    @property
    async def position(self) -> FloatArray:
        """rad or m, of the newest state."""
        return (await self.read()).position

    @property
    async def velocity(self) -> FloatArray:
        """rad/s or m/s, of the newest state."""
        return (await self.read()).velocity

    @property
    async def effort(self) -> FloatArray:
        """What the actuators applied over the last step, N m or N."""
        return (await self.read()).effort

    @property
    async def target(self) -> FloatArray:
        """Positions, velocities or efforts, as the modes say."""
        return (await self.read()).target

    def watch(self, rate: float | None = None) -> Watch[RobotState]:
        """States as they are published, at most `rate` of them a wall second, newest-wins.

        The daemon publishes 100 a second if it is not told otherwise; `Simulation.watch` can have each step.
        """
        simulation = self._simulation
        source = state_source(simulation.link.name, self._memory, self.name)
        return Watch(simulation.link, source, rate, simulation.timeout)

    # What it is asked to do.

    def set_targets(self, targets: RobotTargets, *, beyond_limit: BeyondLimit = "clamp") -> Answer[Applied]:
        """An array of positions in joint order, a `Whole`, or a number or `Target` by joint name; all or none."""
        return self.run(joints.set_targets(self._memory, {self.name: targets}, beyond_limit))

    def set_positions(
        self, positions: npt.ArrayLike | Mapping[str, float], *, beyond_limit: BeyondLimit = "clamp"
    ) -> Answer[Applied]:
        """Go there and stay: rad or m, as an array in joint order or by joint name."""
        targets = positions if isinstance(positions, Mapping) else Whole.positions(positions)
        return self.set_targets(targets, beyond_limit=beyond_limit)

    def set_velocities(
        self, velocities: npt.ArrayLike, *, beyond_limit: BeyondLimit = "clamp"
    ) -> Answer[Applied]:
        """Turn and slide at these rates: rad/s or m/s in joint order."""
        return self.set_targets(Whole.velocities(velocities), beyond_limit=beyond_limit)

    def set_efforts(self, efforts: npt.ArrayLike, *, beyond_limit: BeyondLimit = "clamp") -> Answer[Applied]:
        """Apply these efforts until told otherwise: N m or N in joint order."""
        return self.set_targets(Whole.efforts(efforts), beyond_limit=beyond_limit)

    def hold(self) -> Answer[Applied]:
        """All joints stay where they are."""
        return self.set_targets(Whole.hold())

    def set_passive(self) -> Answer[Applied]:
        """No actuators: only the joints' own damping and friction."""
        return self.set_targets(Whole.passive())

    def stream_targets(self, targets: RobotTargets) -> Answer[None]:
        """Sends targets without waiting for an answer; see `Simulation.stream_targets`."""
        return self._simulation.stream_targets({self.name: targets})

    def claim(self, *names: str, holder: str = "", lease: float = 10.0) -> Answer[Claim]:
        """Takes these joints, or all of them, for this client; see `Simulation.claim`."""
        return self._simulation.claim({self.name: names}, holder=holder, lease=lease)

    def reset_joints(
        self,
        positions: Mapping[str, float] | npt.ArrayLike | None = None,
        velocities: Mapping[str, float] | npt.ArrayLike | None = None,
    ) -> Answer[Stamp]:
        """Puts joints at positions and rates, by name or as arrays; all of them back to where they were
        spawned where nothing is given. Targets stay, but a joint that holds its position holds the new one."""
        if positions is None or isinstance(positions, Mapping):
            rates = velocities if velocities is None or isinstance(velocities, Mapping) else None
            if rates is not velocities:
                raise ValueError("positions and velocities are both by name or both arrays")
            return self.run(joints.reset_joints(self._memory, self.name, positions, rates))
        if isinstance(velocities, Mapping):
            raise ValueError("positions and velocities are both by name or both arrays")
        return self.run(joints.reset_to(self._memory, self.name, positions, velocities))

    # Where it is.

    @property
    async def pose(self) -> Pose:
        """`world_from_root`."""
        return (await self.run(robots.state(self.name)))[0]

    @property
    async def twist(self) -> Twist:
        """Velocity of the root link's origin, world axes."""
        return (await self.run(robots.state(self.name)))[1]

    def set_state(self, pose: Pose | None = None, twist: Twist | None = None) -> Answer[Stamp]:
        """Puts the root link elsewhere; what is left out stays. The twist of a fixed base must be zero."""
        return self.run(robots.set_state(self.name, pose, twist))

    async def link_poses(self) -> dict[str, Pose]:
        """`world_from_link` of each link."""
        rows = await self.run(robots.link_poses(self.name))
        return {name: Pose(row[:3], row[3:]) for name, row in zip(self.links, rows)}

    def apply_wrench(
        self,
        link: str,
        force: npt.ArrayLike = (0, 0, 0),
        torque: npt.ArrayLike = (0, 0, 0),
        *,
        frame: str = "world",
        point: npt.ArrayLike | None = None,
        persistent: bool = False,
    ) -> Answer[Stamp]:
        """Pushes a link with a force (N) at `point` (in the link's frame, metres) and a torque (N m), for
        the next step, or until it is replaced or cleared. `frame` says whose axes: `world` or `link`."""
        return self.run(robots.apply_wrench(self.name, link, force, torque, frame, point, persistent))

    # What it touches.

    def contacts(self) -> Answer[tuple[Contact, ...]]:
        """The points at which it touches others or itself, of the newest state."""
        return self.run(contacts.contacts(self.name))

    def surfaces(self) -> Answer[dict[str, Surface]]:
        """How its links rub and bounce, by link; without numbers where one touches nothing."""
        return self.run(robots.surfaces(self.name))

    def set_surface(
        self, *, friction: float | None = None, restitution: float | None = None, link: str | None = None
    ) -> Answer[Stamp]:
        """Changes how a link, or all of them, rub and bounce; what is left out stays."""
        surface = Surface(friction, restitution)
        return self.run(robots.set_surfaces(self.name, {link or "": surface}))

    # What follows from where it is.

    def link_states(self) -> Answer[LinkStates]:
        """Poses and velocities of all links, in the order of `links`."""
        return self.run(kinematics.link_states(self.name))

    def joint_reactions(self) -> Answer[JointReactions]:
        """What each joint carried over the last step: force and torque of the parent link on the child."""
        return self.run(kinematics.joint_reactions(self._memory, self.name))

    def jacobian(
        self, link: str, point: npt.ArrayLike | None = None, configuration: Configuration | None = None
    ) -> Answer[Jacobian]:
        """How rates move a point of a link (in its frame, metres; its origin where left out)."""
        return self.run(kinematics.jacobian(self.name, link, point, configuration))

    def mass_matrix(self, configuration: Configuration | None = None) -> Answer[FloatArray]:
        """The joint-space inertia matrix, armature included; a free root's six rates come first."""
        return self.run(kinematics.mass_matrix(self.name, configuration))

    def inverse_dynamics(
        self, accelerations: npt.ArrayLike | None = None, configuration: Configuration | None = None
    ) -> Answer[FloatArray]:
        """The efforts that give these accelerations (none: zero) under gravity, without contacts, limits and
        friction; a free root's six come first."""
        return self.run(kinematics.inverse_dynamics(self.name, accelerations, configuration))

    def inverse_kinematics(
        self,
        link: str,
        position: npt.ArrayLike,
        orientation: npt.ArrayLike | None = None,
        *,
        point: npt.ArrayLike | None = None,
        guess: Configuration | None = None,
        joints: Iterable[str] = (),
        max_iterations: int = 0,
        tolerance: float = 0.0,
    ) -> Answer[InverseKinematics]:
        """Joint positions at which `point` of a link is at `position` (metres, world) and the link is turned
        by `orientation` (x y z w), within the limits. `joints` may move, all where none is named; 0 leaves
        `max_iterations` and `tolerance` (metres) at 300 and 1e-4."""
        plan = kinematics.inverse_kinematics(
            self.name, link, position, orientation, point, guess, tuple(joints), max_iterations, tolerance
        )
        return self.run(plan)

    # What it is.

    async def info(self) -> RobotInfo:
        """Mass, links and base, as they are now."""
        self._info = await self.run(robots.info(self.name))
        return self._info

    def scene(self) -> Answer[proto.RobotScene]:
        """What is to be drawn: visuals and colliders."""
        return self.run(robots.scene(self.name))

    def reload(self, *, strict: bool = False) -> Answer[Reloaded]:
        """Reads its description again from where it came. Pose, positions, rates and targets stay."""
        return self._reloaded(robots.reload(self._memory, self.name, None, strict))

    def reload_from(
        self, path: AnyPath, *, packages: Packages | None = None, strict: bool = False
    ) -> Answer[Reloaded]:
        """Sends a new export from this disk, and reads it."""
        return self._reloaded(robots.reload_from(self._memory, self.name, path, packages, strict))

    async def _reloaded(self, plan: Plan[Reloaded]) -> Reloaded:
        reloaded = await self.run(plan)
        self._report = reloaded.report
        await self.info()
        return reloaded

    def delete(self) -> Answer[Stamp]:
        """Takes it out of the world."""
        return self.run(robots.delete(self._memory, self.name))

    def __repr__(self) -> str:
        return f"<Robot {self._title()}>\n{self._joint_table(self._memory.layout(self.name)).text()}"

    def _repr_html_(self) -> str:
        return self._joint_table(self._memory.layout(self.name)).html(self._title())
