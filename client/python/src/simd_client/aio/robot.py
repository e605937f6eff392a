"""A robot in the world, as an object."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Literal

import numpy.typing as npt

from simd_client import keys, proto
from simd_client.aio.callbacks import Callbacks
from simd_client.aio.cameras import Cameras
from simd_client.aio.claim import Claim
from simd_client.aio.connection import Connection
from simd_client.aio.joint import Joint, Joints
from simd_client.aio.robot_pose import RobotPose
from simd_client.aio.sensors import Sensors
from simd_client.aio.trajectory import Trajectory
from simd_client.aio.upload import upload
from simd_client.aio.watch import EventWatch, Watch, next_events
from simd_client.description import LoadReport, Reloaded, RobotInfo, report_from_proto, robot_info_from_proto
from simd_client.description_files import AnyPath, Packages
from simd_client.errors import AnswerError  # asyncio only
# blocking: from simd_client.errors import AnswerError, SimdError
from simd_client.expansion import Arguments
from simd_client.geometry import FloatArray, Pose, rows
from simd_client.layout import Gains, JointLimits, JointMode, JointSpring, Layout, joint_properties
from simd_client.method import decoded
from simd_client.proto import methods
from simd_client.quantity import Quantity
from simd_client.reset import JointValues
from simd_client.state import Applied, RobotState
from simd_client.table import Table
from simd_client.target import BeyondLimit, RobotTargets, Whole, whole_or_by_name
from simd_client.trajectory import (
    Tolerance,
    TrajectoryProgress,
    points_to_proto,
    progress_from_proto,
    tolerances_to_proto,
)
from simd_client.world import Stamp, stamp_from_proto


class Robot(RobotPose):
    """A robot in the world. Arrays are float64, in joint order: one entry for each joint that moves along one axis,
    none for fixed joints (`joint_names` lists the others).

    Each property that changes, and each method, is one round trip; `read` returns everything of one moment.
    """

    def __init__(self, connection: Connection, info: RobotInfo, report: LoadReport | None = None) -> None:
        super().__init__(connection, info.name)
        self._info = info
        self._report = report or LoadReport()
        self._cached: tuple[Layout, Joints] | None = None

    @property
    def report(self) -> LoadReport:
        """Report on how its description was read, if this object loaded it."""
        return self._report

    @property
    def links(self) -> tuple[str, ...]:
        """Names of its links in depth-first order, fetched when this object was made."""
        return tuple(link.name for link in self._info.links)

    @property
    def layout(self) -> Layout:
        """Its joints, and their indices in the arrays; see `refresh`."""
        # The layout that was fetched last: a property cannot ask the daemon without being awaited.  # asyncio only
        known = self._connection.cache.layout(self.name)  # asyncio only
        if known is None:  # asyncio only
            raise RuntimeError(f"the layout of robot `{self.name}` was never fetched")  # asyncio only
        return known  # asyncio only
        # blocking: return self._connection.layout(self.name)

    async def refresh(self) -> Layout:
        """Fetches the layout again, including changes by other clients: limits, gains, claims."""
        return await self._connection.fetch_layout(self.name)

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
        """Names of the movable joints, in order."""
        return tuple(joint.name for joint in self.layout.moving)

    # State.

    async def read(self) -> RobotState:
        """Returns positions, velocities, efforts, targets and modes of one moment."""
        states = await self._connection.states(self.name)
        if self.name not in states:
            raise AnswerError(f"the daemon's answer cannot be understood: it lacks robot `{self.name}`")
        return states[self.name]

    async def states(self, names: Iterable[str]) -> RobotState:
        """Like `read`, for some of its joints."""
        return (await self._connection.states({self.name: tuple(names)}))[self.name]

    @property
    async def position(self) -> FloatArray:
        """Positions in rad or m, of the newest state."""
        return (await self.read()).position

    @property
    async def velocity(self) -> FloatArray:
        """Velocities in rad/s or m/s, of the newest state."""
        return (await self.read()).velocity

    @property
    async def effort(self) -> FloatArray:
        """Efforts that the actuators applied over the last step, N m or N."""
        return (await self.read()).effort

    @property
    async def target(self) -> FloatArray:
        """A position, velocity or effort per joint, depending on its mode."""
        return (await self.read()).target

    def watch(self, rate: float | None = None, *, sensors: bool | Collection[str] = False) -> Watch[RobotState]:
        """Iterates over states as they are published, at most `rate` per wall second; the newest wins.

        By default the daemon publishes 100 per second; `Simulation.watch` can have each step. With names of
        `sensors`, or `True` for all, states also have their newest readings in `sensors`; each state then
        takes a round trip.
        """
        return _StateWatch(self, rate, sensors)

    def on_state(self, function: Callable[[RobotState], object], rate: float | None = None) -> Callbacks[RobotState]:
        """Calls a function with the current state, and with states as they are published, as `watch` gives them."""
        return Callbacks(self._connection.link, self.watch(rate), function)

    @property
    def sensors(self) -> Sensors:
        """Sensors of the robot."""
        return Sensors(self._connection, self.name)

    @property
    def cameras(self) -> Cameras:
        """Cameras of the robot."""
        return Cameras(self._connection, self.name)

    # Targets.

    async def set_targets(self, targets: RobotTargets, *, beyond_limit: BeyondLimit = "clamp") -> Applied:
        """Sets all targets or none: an array of positions in joint order, a `Whole`, or a number or `Target` by
        joint name."""
        return await self._connection.set_targets({self.name: targets}, beyond_limit=beyond_limit)

    async def set_positions(
        self, positions: npt.ArrayLike | Mapping[str, Quantity], *, beyond_limit: BeyondLimit = "clamp"
    ) -> Applied:
        """Moves to these positions and stays there: rad or m, as an array in joint order or by joint name.
        Named positions may have units (`{"elbow": "90deg"}`)."""
        return await self._set_all(JointMode.POSITION, positions, beyond_limit)

    async def set_velocities(
        self, velocities: npt.ArrayLike | Mapping[str, Quantity], *, beyond_limit: BeyondLimit = "clamp"
    ) -> Applied:
        """Moves at these velocities: rad/s or m/s, as an array in joint order or by joint name (`{"elbow":
        "30rpm"}`)."""
        return await self._set_all(JointMode.VELOCITY, velocities, beyond_limit)

    async def set_efforts(
        self, efforts: npt.ArrayLike | Mapping[str, Quantity], *, beyond_limit: BeyondLimit = "clamp"
    ) -> Applied:
        """Applies these efforts until the next target: N m or N, as an array in joint order or by joint
        name."""
        return await self._set_all(JointMode.EFFORT, efforts, beyond_limit)

    async def hold(self) -> Applied:
        """Holds all joints where they are."""
        return await self.set_targets(Whole.hold())

    async def set_passive(self) -> Applied:
        """Switches all actuators off: only the joints' damping and friction remain."""
        return await self.set_targets(Whole.passive())

    async def stream_targets(self, targets: RobotTargets) -> None:
        """Sends targets without waiting for an answer; see `Simulation.stream_targets`."""
        await self._connection.stream_targets({self.name: targets})

    async def follow(
        self,
        times: npt.ArrayLike,
        positions: npt.ArrayLike,
        velocities: npt.ArrayLike | None = None,
        accelerations: npt.ArrayLike | None = None,
        efforts: npt.ArrayLike | None = None,
        *,
        joints: Sequence[str] | None = None,
        queued: bool = False,
        delay: float = 0.0,
        path_tolerance: Tolerance = None,
        goal_tolerance: Tolerance = None,
        goal_time_tolerance: float | None = None,
    ) -> Trajectory:
        """Executes a trajectory on the robot's joints, at the daemon's steps.

        `times` are simulated seconds from its beginning. The other arrays have a row for each time and a
        column for each of `joints`. The default is all joints of one axis that take targets. Between two rows
        positions are linear in time, cubic with velocities, quintic with accelerations too. The way to the
        first row begins at the joints' current targets. Efforts are added to the actuators' efforts.

        It begins with the next step, after a delay, or queued: when earlier trajectories of its joints have
        succeeded. A joint that is farther from the path than `path_tolerance` ends it. It has succeeded once
        all joints are within `goal_tolerance` of the last row; `goal_time_tolerance` limits the seconds after
        its end for that, if given.
        """
        moving = (each for each in self.layout.joints if each.is_actuated and each.dof == 1)
        names = [each.name for each in moving] if joints is None else list(joints)
        request = proto.FollowTrajectoryRequest(
            robot=self.name,
            joints=names,
            points=points_to_proto(names, times, positions, velocities, accelerations, efforts),
            queued=queued,
            delay=delay,
            path_tolerances=tolerances_to_proto(names, path_tolerance),
            goal_tolerances=tolerances_to_proto(names, goal_tolerance),
            goal_time_tolerance=goal_time_tolerance,
        )
        # The subscription begins before the trajectory, so that the end is among the events.
        events = EventWatch(self._connection, (await next_events(self._connection, 0, 0.0))[1])
        answer = await self._connection.call(methods.FollowTrajectory, request)
        return Trajectory(self._connection, self.name, answer.id, events)

    async def trajectories(self) -> list[TrajectoryProgress]:
        """Returns trajectories that its joints execute or that wait, in the order in which they were
        given."""
        answer = await self._connection.call(
            methods.ListTrajectories, proto.ListTrajectoriesRequest(robot=self.name)
        )
        return [progress_from_proto(each) for each in answer.trajectories]

    async def cancel_trajectories(self) -> Stamp:
        """Ends all trajectories of its joints; the joints hold where they are."""
        request = proto.CancelTrajectoryRequest(robot=self.name)
        return stamp_from_proto((await self._connection.call(methods.CancelTrajectory, request)).stamp)

    async def claim(self, *names: str, holder: str = "", lease: float = 10.0, priority: int = 0) -> Claim:
        """Claims these joints, or the whole robot, for this client; see `Simulation.claim`."""
        return await self._connection.claim({self.name: names}, holder=holder, lease=lease, priority=priority)

    async def reset_joints(
        self,
        positions: JointValues | None = None,
        velocities: JointValues | None = None,
        *,
        beyond_limit: BeyondLimit | Literal["keep"] = "clamp",
    ) -> Applied:
        """Sets positions and velocities of joints at once, by name or as arrays. Without arguments, it
        restores the values from the spawn. Targets stay, but a joint that holds its position holds the new
        one. A position beyond a limit is clamped and reported, as for a target, or refused; with `"keep"` the
        joint starts beyond its limit."""
        moving = None if velocities is None else {self.name: velocities}
        return await self._connection.reset_joints({self.name: positions}, moving, beyond_limit=beyond_limit)

    async def set_joint_properties(
        self,
        *names: str,
        damping: float | None = None,
        friction: float | None = None,
        armature: float | None = None,
        spring: JointSpring | None = None,
        limits: JointLimits | None = None,
        default_gains: Gains | None = None,
        gravity_compensation: bool | None = None,
        profile: bool | None = None,
    ) -> Stamp:
        """Changes the given properties of these joints, or of all that take targets: see
        `Joint.set_properties`. All or none change."""
        joints = [
            joint_properties(
                name, damping, friction, armature, spring, limits, default_gains, gravity_compensation, profile
            )
            for name in names or tuple(each.name for each in self.layout.joints if each.is_actuated)
        ]
        request = proto.SetJointPropertiesRequest(robot=self.name, joints=joints)
        answer = await self._connection.call(methods.SetJointProperties, request)
        self._connection.cache.mark_stale(self.name)
        return stamp_from_proto(answer.stamp)

    async def link_poses(self) -> dict[str, Pose]:
        """`world_from_link` of each link."""
        request = proto.GetLinkPosesRequest(robots=[self.name])
        answer = await self._connection.call(methods.GetLinkPoses, request)
        poses = rows(answer.robots[0].poses if answer.robots else (), 7)
        return {name: Pose(pose[:3], pose[3:]) for name, pose in zip(self.links, poses)}

    # Description.

    async def info(self) -> RobotInfo:
        """Current mass, links and base."""
        request = proto.GetEntityInfoRequest(robot=self.name)
        answer = await self._connection.call(methods.GetEntityInfo, request)
        self._info = robot_info_from_proto(answer.entity)
        return self._info

    async def scene(self) -> proto.RobotScene:
        """Visuals and colliders of the robot."""
        request = proto.GetSceneRequest(robots=[self.name])
        answer = await self._connection.call(methods.GetScene, request)
        return answer.robots[0] if answer.robots else proto.RobotScene(robot=self.name)

    async def reload(self, *, strict: bool = False) -> Reloaded:
        """Reads its description again from its source. Pose, positions, velocities and targets stay."""
        return await self._reload(None, strict)

    async def reload_from(
        self,
        path: AnyPath,
        *,
        packages: Packages | None = None,
        xacro_arguments: Arguments | None = None,
        strict: bool = False,
    ) -> Reloaded:
        """Replaces its description with one from this disk. Pose, positions, velocities and targets stay."""
        source = await upload(self._connection, path, packages, xacro_arguments)
        return await self._reload(source, strict)

    async def delete(self) -> Stamp:
        """Removes the robot from the world."""
        answer = await self._connection.call(
            methods.DeleteEntity, proto.DeleteEntityRequest(robot=self.name)
        )
        self._connection.cache.mark_stale(self.name)
        return stamp_from_proto(answer.stamp)

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def __repr__(self) -> str:
        return f"<Robot {self._title()}>\n{self._table().text()}"

    def _repr_html_(self) -> str:
        return self._table().html(self._title())

    def _key(self) -> tuple[int, str]:
        return id(self._connection.cache), self.name

    def _title(self) -> str:
        info = self._info
        base = "fixed" if info.is_fixed else "free"
        return f"{self.name}: {info.moving_joint_count} of {info.joint_count} joints move, {base} base, {info.mass:.4g} kg"

    def _table(self) -> Table:
        # blocking: # With its state if the daemon answers: a notebook also shows robots that were deleted.
        # blocking: try:
        # blocking:     return self.read().table()
        # blocking: except SimdError:
        # blocking:     pass
        layout = self._connection.cache.layout(self.name)
        joints = layout.joints if layout else ()
        lines = [(joint.name, joint.type.name.lower(), joint.mode.name.lower()) for joint in joints]
        return Table(("joint", "type", "mode"), lines)

    async def _set_all(
        self, mode: JointMode, values: npt.ArrayLike | Mapping[str, Quantity], beyond_limit: BeyondLimit
    ) -> Applied:
        layout = await self._connection.layout(self.name)
        return await self.set_targets(whole_or_by_name(mode, values, layout), beyond_limit=beyond_limit)

    async def _reload(self, source: proto.DescriptionSource | None, strict: bool) -> Reloaded:
        request = proto.ReloadEntityRequest(robot=self.name, source=source, strict=strict)
        answer = await self._connection.call_until_silent(methods.ReloadEntity, request)
        await self.refresh()
        await self.info()
        self._report = report_from_proto(answer.report)
        added, removed = tuple(answer.added_joints), tuple(answer.removed_joints)
        return Reloaded(self._report, stamp_from_proto(answer.stamp), added, removed)


class _StateWatch(Watch[RobotState]):
    def __init__(self, robot: Robot, rate: float | None, sensors: bool | Collection[str] = False) -> None:
        connection = robot.connection
        super().__init__(connection, keys.joint_states(connection.name, robot.name), rate)
        self._robot = robot
        self._sensors = sensors

    async def _read(self, payload: bytes) -> RobotState | None:
        if self._sensors:
            # Publications have no readings: each only signals that newer ones can be requested.
            return await self._ask()
        states = await self._connection.decode_states(decoded(proto.JointStates, payload))
        return states.robots.get(self._robot.name)

    async def _ask(self) -> RobotState:
        if not self._sensors:
            return await self._robot.read()
        states = await self._connection.next_states(0, 1.0, self._robot.name, sensors=self._sensors)
        return states[self._robot.name]

    def _order(self, item: RobotState) -> int:
        return item.stamp.sequence
