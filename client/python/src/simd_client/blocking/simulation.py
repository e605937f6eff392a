# Generated from simd_client/aio/simulation.py by tools/make_blocking.py; do not edit.
"""A running daemon's world, as an object."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import TracebackType

import numpy.typing as npt

from simd_client import keys, proto
from simd_client.blocking.callbacks import Callbacks, SomeEvents
from simd_client.blocking.cameras import WorldCameras
from simd_client.blocking.constraints import Constraints
from simd_client.blocking.lockstep import Lockstep
from simd_client.blocking.parameters import Parameters
from simd_client.blocking.robot import Robot
from simd_client.blocking.runtime import in_thread
from simd_client.blocking.saved_states import SavedStates
from simd_client.blocking.sensors import WorldSensors
from simd_client.blocking.upload import fetch_file
from simd_client.blocking.view import View
from simd_client.blocking.watch import EventWatch, Watch, WorldWatch, next_events
from simd_client.constraint import ConstraintEnd
from simd_client.contact import contacts_from_proto
from simd_client.description import robot_info_from_proto
from simd_client.errors import AnswerError, RobotNotFound, listed, not_found
from simd_client.event import Event
from simd_client.geometry import vector_to_proto
from simd_client.link_states import link_states_from_proto
from simd_client.method import decoded
from simd_client.picture import CameraPicture, projection_matrix, view_matrix
from simd_client.proto import methods
from simd_client.selection import Selection, SensorSelection, selections_to_proto, sensors_to_proto
from simd_client.state import Named, States, clamped_from_proto, name_of
from simd_client.target import BeyondLimit, Targets, beyond_limit_to_proto
from simd_client.world import (
    Integrator,
    Pace,
    Physics,
    SimulationState,
    SimulatorInfo,
    Stamp,
    SurfaceCombination,
    WorldStatistics,
    info_from_proto,
    integrator_to_proto,
    pace_to_proto,
    physics_from_proto,
    stamp_from_proto,
    state_from_proto,
    state_to_proto,
    statistics_from_proto,
    surface_combination_to_proto,
)

STEP_SECONDS = 0.01
"""Default time, in seconds, that a call may take longer for each requested step."""

LOCKSTEP_SECONDS = 60.0
"""Time, in seconds, that a call waits for the other members beyond a member's time between steps."""


class Simulation(SavedStates):
    """A connection to one daemon. Make one by `connect`, and use it with `with` or `close` it.

    May be used from several threads at once; iterators (`watch`, `events`) and claims belong to one. Calls raise a `SimdError`; each has a timeout.
    """

    _others = 0.0

    def with_timeout(self, timeout: float) -> Simulation:
        """Returns the same connection with another timeout, in seconds."""
        return Simulation(self._link, timeout, self._cache)

    def close(self) -> None:
        """Closes the connection. Robots and targets stay; unreleased claims lapse."""
        in_thread(self._link.close)

    def __enter__(self) -> Simulation:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<Simulation '{self.name}' at {self.endpoint.locator}>"

    # Robots.

    @property
    def robots(self) -> Robots:
        """The robots in the world by name, in the order in which they were spawned."""
        answer = self.call(methods.ListEntities, proto.ListEntitiesRequest())
        found = Robots()
        for entity in answer.entities:
            info = robot_info_from_proto(entity)
            if self.layout(info.name).version != info.layout_version:
                self.fetch_layout(info.name)
            found[info.name] = Robot(self, info)
        return found

    def robot(self, name: str) -> Robot:
        """Returns a robot in the world. Raises `RobotNotFound`."""
        answer = self.call(methods.GetEntityInfo, proto.GetEntityInfoRequest(robot=name))
        info = robot_info_from_proto(answer.entity)
        self.fetch_layout(info.name)
        return Robot(self, info)

    def asset(self, sha256: str) -> bytes:
        """Returns the content of a file that a robot's scene refers to."""
        return fetch_file(self, sha256)

    # Time.

    def step(
        self,
        steps: int = 1,
        targets: Targets | None = None,
        *,
        states: bool | Selection = False,
        link_states: bool = False,
        contacts: bool = False,
        sensors: SensorSelection = False,
        beyond_limit: BeyondLimit = "clamp",
        timeout: float | None = None,
    ) -> States:
        """Makes `steps` steps of a paused or stopped world, as fast as possible, in one round trip. After
        `join_lockstep` the call also waits for the other members' requests.

        `targets`, by robot, apply from the first of the steps on: see `Robot.set_targets` for their form.
        `states` adds the states after the last step, of all robots or of a selection (a robot, several, or
        joints by robot). `link_states` adds the states of their links in `links`, and `contacts` adds their
        contact points. `sensors` (names by robot, names that each selected robot has, or `True`) adds the
        newest readings; the answer waits for their ranges. The default `timeout` is the connection's and 0.01
        s per step. Raises `WrongState` while the world plays, and `Superseded` if a play, pause or reset
        interrupts the steps.
        """
        messages, claim = self._encode_targets(targets or {})
        wanted = bool(link_states or contacts or sensors) or (states is not False and states is not None)
        selected = [] if isinstance(states, bool) else selections_to_proto(states)
        request = proto.StepSimulationRequest(
            steps=steps,
            robots=messages,
            limit_policy=beyond_limit_to_proto(beyond_limit),
            claim=claim,
            return_states=wanted,
            selections=selected,
            return_link_states=link_states,
            return_contacts=contacts,
            sensors=sensors_to_proto(sensors, [each.robot for each in selected]),
            lockstep_member=self._cache.lockstep_member,
        )
        wait = steps * STEP_SECONDS + self._others if timeout is None else timeout - self._timeout
        with self._cache.marking_stale():
            answer = self.call(methods.StepSimulation, request, wait=wait)
        clamped = clamped_from_proto(answer.clamped)
        if not wanted:
            return States(stamp_from_proto(answer.stamp), {}, clamped)
        if not answer.HasField("states"):
            raise AnswerError("the daemon's answer cannot be understood: it did the steps and lacks `states`")
        found = self.decode_states(answer.states, selected, clamped, answer.sensors)
        links = {each.robot: link_states_from_proto(each, found.stamp) for each in answer.link_states}
        touching = contacts_from_proto(answer.contacts)
        return replace(found, links=links, contacts=touching) if links or touching else found

    def join_lockstep(self, timeout: float = 10.0) -> Lockstep:
        """Adds this client to those that step the world together. From then on only they step it, `step`
        waits for the others, and the world does not play. A member loses its membership if it takes longer
        than `timeout` seconds (0.01 to 3,600) from one step to the next request."""
        answer = self.call(methods.JoinLockstep, proto.JoinLockstepRequest(timeout=timeout))
        self._cache.lockstep_member = answer.member
        # Each member, including one that joins later, may use its full time before each step.
        self._others = LOCKSTEP_SECONDS + max(member.timeout for member in answer.members)
        return Lockstep(self, answer.member, timeout)

    def play(self) -> Stamp:
        """Starts or continues the simulation in real time."""
        return self._set_state(SimulationState.PLAYING)

    def pause(self) -> Stamp:
        """Pauses the simulation."""
        return self._set_state(SimulationState.PAUSED)

    def stop(self) -> Stamp:
        """Pauses, and resets time and robots."""
        return self._set_state(SimulationState.STOPPED)

    def reset(self, *, time: bool = False, state: bool = False, spawned: bool = False) -> Stamp:
        """Resets the world: `time` to zero, `state` to the robots' initial state; `spawned` removes robots
        that clients spawned. Without arguments it resets time and state."""
        request = proto.ResetSimulationRequest(time=time, state=state, spawned=spawned)
        return stamp_from_proto(self.call(methods.ResetSimulation, request).stamp)

    @property
    def state(self) -> SimulationState:
        """State of the world: playing, paused or stopped."""
        return state_from_proto(self._get_state().state)

    @property
    def stamp(self) -> Stamp:
        """Stamp of the newest state."""
        return stamp_from_proto(self._get_state().stamp)

    @property
    def physics(self) -> Physics:
        """Gravity, time step, substeps, pace, integrator, surface combination."""
        return physics_from_proto(self.call(methods.GetPhysics, proto.GetPhysicsRequest()).physics)

    def set_physics(
        self,
        *,
        gravity: npt.ArrayLike | None = None,
        time_step: float | None = None,
        substeps: int | None = None,
        real_time_factor: float | None = None,
        pace: Pace | str | None = None,
        integrator: Integrator | str | None = None,
        surface_combination: SurfaceCombination | str | None = None,
        sleeping: bool | None = None,
    ) -> Physics:
        """Changes only the given settings (m/s^2, s). Raises `InvalidValue` and changes nothing if a value is
        refused."""
        request = proto.SetPhysicsRequest(
            gravity=None if gravity is None else vector_to_proto(gravity, "gravity"),
            time_step=time_step,
            substeps=substeps,
            real_time_factor=real_time_factor,
            pace=None if pace is None else pace_to_proto(pace),
            integrator=None if integrator is None else integrator_to_proto(integrator),
            surface_combination=(
                None if surface_combination is None else surface_combination_to_proto(surface_combination)
            ),
        )
        if sleeping is not None:
            request.sleeping = sleeping
        return physics_from_proto(self.call(methods.SetPhysics, request).physics)

    # States over time.

    def watch(
        self, rate: float | None = None, selection: Selection = None, *, sensors: SensorSelection = False
    ) -> WorldWatch:
        """Iterates over states of all robots, all of one moment; the newest wins. It yields each step if the
        reader keeps up, at most `rate` per wall second. The first is the current one. Each costs one round
        trip. `sensors` has the form of `next_states`."""
        return WorldWatch(self, rate, selection, sensors)

    def on_states(
        self, function: Callable[[States], object], rate: float | None = None, selection: Selection = None
    ) -> Callbacks[States]:
        """Calls a function with the current states, and with newer ones, as `watch` gives them."""
        return Callbacks(self._link, self.watch(rate, selection), function)

    def on_event(
        self, function: Callable[[Event], object], *kinds: str, after: int | None = None
    ) -> Callbacks[Event]:
        """Calls a function with each event from now on, or after a sequence. `kinds` selects events such as
        `entity_spawned` or `simulation_reset`: see `Event.kind`."""
        return Callbacks(self._link, SomeEvents(self.events(after), kinds), function)

    def events(self, after: int | None = None) -> EventWatch:
        """Iterates over events from now on, or after a sequence: 0 gives all that the daemon still keeps."""
        begin = next_events(self, 0, 0.0)[1] if after is None else after
        return EventWatch(self, begin)

    @property
    def statistics(self) -> WorldStatistics:
        """Real-time statistics of the world. The call never waits for a step, and also serves as a ping."""
        answer = self.call(methods.GetWorldStatistics, proto.GetWorldStatisticsRequest())
        return statistics_from_proto(answer.statistics)

    def watch_statistics(self, rate: float | None = None) -> Watch[WorldStatistics]:
        """Iterates over statistics as they are published, ten times a second; the newest wins."""
        return _StatisticsWatch(self, rate)

    # Other parts of the world.

    @property
    def constraints(self) -> Constraints:
        """Constraints that hold links together, in addition to the joints of robots."""
        return Constraints(self)

    def attach(
        self,
        robot: str | Named,
        to: str | Named | None = None,
        *,
        link: str = "",
        to_link: str = "",
        name: str = "",
        max_force: float | None = None,
        max_torque: float | None = None,
        breaks: bool = False,
    ) -> str:
        """Holds a link of a robot at its current pose relative to a link of another robot, or to the world.
        Links default to root links. With a limit it yields, or `breaks`. Returns the weld's name;
        `constraints.delete` releases it. Raises `RobotNotFound`, `LinkNotFound`, `InvalidValue`,
        `ConstraintExists`."""
        parent = ConstraintEnd("" if to is None else name_of(to), to_link)
        child = ConstraintEnd(name_of(robot), link)
        return self.constraints.create(
            "weld", parent, child, name=name, max_force=max_force, max_torque=max_torque, breaks=breaks
        )

    @property
    def sensors(self) -> WorldSensors:
        """Sensors of all robots; `Robot.sensors` has one robot's."""
        return WorldSensors(self)

    @property
    def cameras(self) -> WorldCameras:
        """Cameras of all robots, and pictures from any viewpoint."""
        return WorldCameras(self)

    def take_picture(
        self,
        eye: npt.ArrayLike,
        target: npt.ArrayLike,
        *,
        width: int = 640,
        height: int = 480,
        field_of_view: float = 1.0,
        near: float = 0.05,
        far: float = 100.0,
        depth: bool = False,
        segmentation: bool = False,
    ) -> CameraPicture:
        """Returns a picture of the present state from `eye` towards `target`, metres and world axes, with z
        up. The field of view is vertical, in rad. `cameras.take` has more options. Raises `NoRenderer`,
        `PictureTimeout`, `PictureFailed`, `InvalidValue`."""
        view = view_matrix(eye, target)
        projection = projection_matrix(field_of_view, width / height, near, far)
        return self.cameras.take(view, projection, width, height, depth=depth, segmentation=segmentation)

    @property
    def parameters(self) -> Parameters:
        """Sliders and buttons that programs add and people use."""
        return Parameters(self)

    @property
    def view(self) -> View:
        """Drawings in pages, their cameras, and their keys and mouse."""
        return View(self)

    def info(self) -> SimulatorInfo:
        """Versions, limits and features of the daemon."""
        return info_from_proto(self.call(methods.GetSimulatorInfo, proto.GetSimulatorInfoRequest()))

    def _get_state(self) -> proto.GetSimulationStateResponse:
        return self.call(methods.GetSimulationState, proto.GetSimulationStateRequest())

    def _set_state(self, wanted: SimulationState) -> Stamp:
        request = proto.SetSimulationStateRequest(state=state_to_proto(wanted))
        return stamp_from_proto(self.call(methods.SetSimulationState, request).stamp)


class Robots(dict[str, Robot]):
    """Robots by their names."""

    def __missing__(self, name: str) -> Robot:
        message = f"there is no robot `{name}` in this world; there are {listed(self, name)}"
        raise not_found(RobotNotFound, message, robot=name)


class _StatisticsWatch(Watch[WorldStatistics]):
    def __init__(self, simulation: Simulation, rate: float | None) -> None:
        super().__init__(simulation, keys.world_statistics(simulation.name), rate)
        self._simulation = simulation

    def _read(self, payload: bytes) -> WorldStatistics | None:
        return statistics_from_proto(decoded(proto.WorldStatistics, payload))

    def _ask(self) -> WorldStatistics:
        return self._simulation.statistics

    def _order(self, item: WorldStatistics) -> int:
        return item.stamp.sequence
