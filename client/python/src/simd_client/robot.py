"""A robot in the world, as an object."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, TypeVar

import numpy.typing as npt

from simd_client import keys, proto
from simd_client.claim import Claim
from simd_client.description import LoadReport, RobotInfo
from simd_client.errors import SimdError
from simd_client.geometry import FloatArray, Pose, Twist
from simd_client.joint import Joint, Joints
from simd_client.layout import Layout
from simd_client.link_states import LinkStates
from simd_client.memory import Memory
from simd_client.plan import Plan
from simd_client.plans import contacts, joints, kinematics, robots
from simd_client.plans.contacts import Contact
from simd_client.plans.kinematics import Configuration, InverseKinematics, Jacobian, JointReactions
from simd_client.plans.robots import AnyPath, Packages, Reloaded
from simd_client.state import Applied, RobotState
from simd_client.surface import Surface
from simd_client.table import Table
from simd_client.target import BeyondLimit, RobotTargets, Whole
from simd_client.watch import Source, Watch
from simd_client.world import Stamp

if TYPE_CHECKING:
    from simd_client.simulation import Simulation

Result = TypeVar("Result")


def state_source(daemon: str, memory: Memory, robot: str) -> Source[RobotState]:
    """Where a robot's states are watched."""
    return Source(
        keys.joint_states(daemon, robot),
        lambda payload: joints.published_state(memory, robot, payload),
        lambda: joints.robot_state_now(memory, robot),
        lambda state: state.stamp.sequence,
    )


class RobotHandle:
    """What is known of a robot without asking the daemon."""

    def __init__(self, memory: Memory, info: RobotInfo, report: LoadReport | None = None) -> None:
        self._memory = memory
        self._info = info
        self._report = report or LoadReport()

    @property
    def name(self) -> str:
        """In this world."""
        return self._info.name

    @property
    def memory(self) -> Memory:
        """What the connection remembers."""
        return self._memory

    @property
    def report(self) -> LoadReport:
        """What was done to its description on the way in, where this object brought it."""
        return self._report

    @property
    def links(self) -> tuple[str, ...]:
        """Names of its links in depth-first order, as they were at the beginning."""
        return tuple(link.name for link in self._info.links)

    def _joint_table(self, layout: Layout | None) -> Table:
        joints = layout.joints if layout else ()
        rows = [(joint.name, joint.type.name.lower(), joint.mode.name.lower()) for joint in joints]
        return Table(("joint", "type", "mode"), rows)

    def _title(self) -> str:
        info = self._info
        base = "fixed" if info.is_fixed else "free"
        return f"{self.name}: {info.moving_joint_count} of {info.joint_count} joints move, {base} base, {info.mass:.4g} kg"

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def _key(self) -> tuple[int, str]:
        return id(self._memory), self.name


class Robot(RobotHandle):
    """A robot in the world. Arrays are float64, in joint order: one entry for each joint that moves along
    one axis, none for fixed joints (`joint_names` names them).

    Each property that moves, and each method, is one round trip; `read()` has everything of one moment.
    """

    def __init__(self, simulation: Simulation, info: RobotInfo, report: LoadReport | None = None) -> None:
        super().__init__(simulation.memory, info, report)
        self._simulation = simulation
        self._cached: tuple[Layout, Joints] | None = None

    def run(self, plan: Plan[Result]) -> Result:
        """Does what a plan says."""
        return self._simulation.run(plan)

    @property
    def layout(self) -> Layout:
        """Its joints, and where each has its values in the arrays. Fetched again after a reload."""
        return self.run(joints.layout(self._memory, self.name))

    def refresh(self) -> Layout:
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

    def read(self) -> RobotState:
        """Positions, velocities, efforts, targets and modes of one moment."""
        return self.run(joints.robot_state_now(self._memory, self.name))

    def states(self, names: Iterable[str]) -> RobotState:
        """The same of some joints."""
        return self.run(joints.states(self._memory, {self.name: tuple(names)}))[self.name]

    @property
    def position(self) -> FloatArray:
        """rad or m, of the newest state."""
        return self.read().position

    @property
    def velocity(self) -> FloatArray:
        """rad/s or m/s, of the newest state."""
        return self.read().velocity

    @property
    def effort(self) -> FloatArray:
        """What the actuators applied over the last step, N m or N."""
        return self.read().effort

    @property
    def target(self) -> FloatArray:
        """Positions, velocities or efforts, as the modes say."""
        return self.read().target

    def watch(self, rate: float | None = None) -> Watch[RobotState]:
        """States as they are published, at most `rate` of them a wall second, newest-wins.

        The daemon publishes 100 a second if it is not told otherwise; `Simulation.watch` can have each step.
        """
        simulation = self._simulation
        source = state_source(simulation.link.name, self._memory, self.name)
        return Watch(simulation.link, source, rate, simulation.timeout)

    # What it is asked to do.

    def set_targets(self, targets: RobotTargets, *, beyond_limit: BeyondLimit = "clamp") -> Applied:
        """An array of positions in joint order, a `Whole`, or a number or `Target` by joint name; all or none."""
        return self.run(joints.set_targets(self._memory, {self.name: targets}, beyond_limit))

    def set_positions(
        self, positions: npt.ArrayLike | Mapping[str, float], *, beyond_limit: BeyondLimit = "clamp"
    ) -> Applied:
        """Go there and stay: rad or m, as an array in joint order or by joint name."""
        targets = positions if isinstance(positions, Mapping) else Whole.positions(positions)
        return self.set_targets(targets, beyond_limit=beyond_limit)

    def set_velocities(self, velocities: npt.ArrayLike, *, beyond_limit: BeyondLimit = "clamp") -> Applied:
        """Turn and slide at these rates: rad/s or m/s in joint order."""
        return self.set_targets(Whole.velocities(velocities), beyond_limit=beyond_limit)

    def set_efforts(self, efforts: npt.ArrayLike, *, beyond_limit: BeyondLimit = "clamp") -> Applied:
        """Apply these efforts until told otherwise: N m or N in joint order."""
        return self.set_targets(Whole.efforts(efforts), beyond_limit=beyond_limit)

    def hold(self) -> Applied:
        """All joints stay where they are."""
        return self.set_targets(Whole.hold())

    def set_passive(self) -> Applied:
        """No actuators: only the joints' own damping and friction."""
        return self.set_targets(Whole.passive())

    def stream_targets(self, targets: RobotTargets) -> None:
        """Sends targets without waiting for an answer; see `Simulation.stream_targets`."""
        self._simulation.stream_targets({self.name: targets})

    def claim(self, *names: str, holder: str = "", lease: float = 10.0) -> Claim:
        """Takes these joints, or all of them, for this client; see `Simulation.claim`."""
        return self._simulation.claim({self.name: names}, holder=holder, lease=lease)

    def reset_joints(
        self,
        positions: Mapping[str, float] | npt.ArrayLike | None = None,
        velocities: Mapping[str, float] | npt.ArrayLike | None = None,
    ) -> Stamp:
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
    def pose(self) -> Pose:
        """`world_from_root`."""
        return self.run(robots.state(self.name))[0]

    @property
    def twist(self) -> Twist:
        """Velocity of the root link's origin, world axes."""
        return self.run(robots.state(self.name))[1]

    def set_state(self, pose: Pose | None = None, twist: Twist | None = None) -> Stamp:
        """Puts the root link elsewhere; what is left out stays. The twist of a fixed base must be zero."""
        return self.run(robots.set_state(self.name, pose, twist))

    def link_poses(self) -> dict[str, Pose]:
        """`world_from_link` of each link."""
        rows = self.run(robots.link_poses(self.name))
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
    ) -> Stamp:
        """Pushes a link with a force (N) at `point` (in the link's frame, metres) and a torque (N m), for
        the next step, or until it is replaced or cleared. `frame` says whose axes: `world` or `link`."""
        return self.run(robots.apply_wrench(self.name, link, force, torque, frame, point, persistent))

    # What it touches.

    def contacts(self) -> tuple[Contact, ...]:
        """The points at which it touches others or itself, of the newest state."""
        return self.run(contacts.contacts(self.name))

    def surfaces(self) -> dict[str, Surface]:
        """How its links rub and bounce, by link; without numbers where one touches nothing."""
        return self.run(robots.surfaces(self.name))

    def set_surface(
        self, *, friction: float | None = None, restitution: float | None = None, link: str | None = None
    ) -> Stamp:
        """Changes how a link, or all of them, rub and bounce; what is left out stays."""
        surface = Surface(friction, restitution)
        return self.run(robots.set_surfaces(self.name, {link or "": surface}))

    # What follows from where it is.

    def link_states(self) -> LinkStates:
        """Poses and velocities of all links, in the order of `links`."""
        return self.run(kinematics.link_states(self.name))

    def joint_reactions(self) -> JointReactions:
        """What each joint carried over the last step: force and torque of the parent link on the child."""
        return self.run(kinematics.joint_reactions(self._memory, self.name))

    def jacobian(
        self, link: str, point: npt.ArrayLike | None = None, configuration: Configuration | None = None
    ) -> Jacobian:
        """How rates move a point of a link (in its frame, metres; its origin where left out)."""
        return self.run(kinematics.jacobian(self.name, link, point, configuration))

    def mass_matrix(self, configuration: Configuration | None = None) -> FloatArray:
        """The joint-space inertia matrix, armature included; a free root's six rates come first."""
        return self.run(kinematics.mass_matrix(self.name, configuration))

    def inverse_dynamics(
        self, accelerations: npt.ArrayLike | None = None, configuration: Configuration | None = None
    ) -> FloatArray:
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
    ) -> InverseKinematics:
        """Joint positions at which `point` of a link is at `position` (metres, world) and the link is turned
        by `orientation` (x y z w), within the limits. `joints` may move, all where none is named; 0 leaves
        `max_iterations` and `tolerance` (metres) at 300 and 1e-4."""
        plan = kinematics.inverse_kinematics(
            self.name, link, position, orientation, point, guess, tuple(joints), max_iterations, tolerance
        )
        return self.run(plan)

    # What it is.

    def info(self) -> RobotInfo:
        """Mass, links and base, as they are now."""
        self._info = self.run(robots.info(self.name))
        return self._info

    def scene(self) -> proto.RobotScene:
        """What is to be drawn: visuals and colliders."""
        return self.run(robots.scene(self.name))

    def reload(self, *, strict: bool = False) -> Reloaded:
        """Reads its description again from where it came. Pose, positions, rates and targets stay."""
        return self._reloaded(lambda: robots.reload(self._memory, self.name, None, strict))

    def reload_from(
        self, path: AnyPath, *, packages: Packages | None = None, strict: bool = False
    ) -> Reloaded:
        """Sends a new export from this disk, and reads it."""
        return self._reloaded(lambda: robots.reload_from(self._memory, self.name, path, packages, strict))

    def _reloaded(self, plan: Callable[[], Plan[Reloaded]]) -> Reloaded:
        reloaded = self.run(plan())
        self._report = reloaded.report
        self.info()
        return reloaded

    def delete(self) -> Stamp:
        """Takes it out of the world."""
        return self.run(robots.delete(self._memory, self.name))

    def __repr__(self) -> str:
        return f"<Robot {self._title()}>\n{self._now().text()}"

    def _repr_html_(self) -> str:
        return self._now().html(self._title())

    def _now(self) -> Table:
        """With its state where the daemon answers: a notebook shows robots that are long gone, too."""
        try:
            return self.read().table()
        except SimdError:
            return self._joint_table(self._memory.layout(self.name))
