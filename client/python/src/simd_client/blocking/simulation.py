# Generated from simd_client/aio/simulation.py by tools/make_blocking.py; do not edit.
"""A running daemon's world, as an object."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import TracebackType

import numpy as np
import numpy.typing as npt

from simd_client import keys, proto
from simd_client.blocking.callbacks import Callbacks, SomeEvents
from simd_client.blocking.constraints import Constraints
from simd_client.blocking.lockstep import Lockstep
from simd_client.blocking.parameters import Parameters
from simd_client.blocking.primitives import Primitives
from simd_client.blocking.recording import Recording
from simd_client.blocking.robot import Robot
from simd_client.blocking.runtime import in_thread
from simd_client.blocking.upload import fetch_file, send_saved_state, write_file
from simd_client.blocking.watch import EventWatch, Watch, WorldWatch, next_events
from simd_client.contact import Contact, RayHits, contacts_from_proto, hits_from_proto, ray_ends, ray_requests
from simd_client.description import robot_info_from_proto
from simd_client.description_files import AnyPath
from simd_client.errors import AnswerError, RobotNotFound, listed, not_found
from simd_client.event import Event
from simd_client.geometry import Pose, pose_to_proto, vector_from_proto, vector_to_proto
from simd_client.link_states import link_states_from_proto
from simd_client.method import decoded
from simd_client.proto import methods
from simd_client.query import (
    ClosestPoints,
    LinkBounds,
    Shape,
    Side,
    bounds_from_proto,
    closest_from_proto,
    side_to_proto,
)
from simd_client.recording import RecordingInfo, recording_from_proto
from simd_client.selection import Selection, selections_to_proto
from simd_client.state import Named, States, clamped_from_proto, name_of
from simd_client.target import BeyondLimit, Targets, beyond_limit_to_proto
from simd_client.world import (
    Integrator,
    Pace,
    Physics,
    SimulationState,
    SimulatorInfo,
    SavedState,
    Stamp,
    WorldStatistics,
    info_from_proto,
    integrator_to_proto,
    pace_to_proto,
    physics_from_proto,
    saved_state_from_proto,
    stamp_from_proto,
    state_from_proto,
    state_to_proto,
    statistics_from_proto,
)

STEP_SECONDS = 0.01
"""How much longer a call may take for each step that it asks for, by default."""

LOCKSTEP_SECONDS = 60.0
"""How much longer than a member may take from step to step a call waits for the others."""

FILE_SECONDS = 120.0
"""How much longer an export or import may take than other calls: all robots of a world are read again."""


class Simulation(Primitives):
    """A connection to one daemon. Make one by `connect`, and use it with `with` or `close` it.

    May be used from several threads at once; iterators (`watch`, `events`) and claims belong to one. Calls raise a `SimdError`; each has a timeout.
    """

    _others = 0.0

    def with_timeout(self, timeout: float) -> Simulation:
        """The same connection with another timeout, in seconds."""
        return Simulation(self._link, timeout, self._cache)

    def close(self) -> None:
        """Closes the connection. Robots and targets stay; claims that were not released lapse."""
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
        """A robot that is in the world. Raises `RobotNotFound`."""
        answer = self.call(methods.GetEntityInfo, proto.GetEntityInfoRequest(robot=name))
        info = robot_info_from_proto(answer.entity)
        self.fetch_layout(info.name)
        return Robot(self, info)

    def contacts(self, robot: str | Named | None = None) -> tuple[Contact, ...]:
        """The contact points of the newest state: of all robots, or those of one robot."""
        request = proto.GetContactsRequest(robot="" if robot is None else name_of(robot))
        return contacts_from_proto(self.call(methods.GetContacts, request).contacts)

    def cast_rays(
        self, starts: npt.ArrayLike, ends: npt.ArrayLike, *, collision_mask: int | None = None
    ) -> RayHits:
        """The first hit of each ray in the newest state: one row per ray, metres, world axes; all rays may share
        one start. Only links in one of the groups of `collision_mask` are hit. Up to 20,000 rays are one round trip."""
        begin, end = ray_ends(starts, ends)
        hits: list[proto.RayHit] = []
        for request in ray_requests(begin, end, collision_mask):
            hits.extend(self.call(methods.CastRays, request).hits)
        return hits_from_proto(hits, end)

    def closest_points(
        self,
        a: Side,
        b: Side | None = None,
        *,
        max_distance: float | None = None,
        nearest_only: bool = False,
        filtered: bool = False,
    ) -> tuple[ClosestPoints, ...]:
        """Where links of two robots are nearest to each other, and how far apart: one for each pair of links. `b` is
        every other robot if it is left out, and may be the same as `a`. A `Place` names one link, or a configuration
        that the robot is not in; a `Shape` or `PlacedShape` is of no robot. `filtered` leaves out links that may not touch each other."""
        request = proto.GetClosestPointsRequest(
            a=side_to_proto(a),
            b=None if b is None else side_to_proto(b),
            max_distance=max_distance,
            nearest_only=nearest_only,
            filtered=filtered,
        )
        return closest_from_proto(self.call(methods.GetClosestPoints, request).pairs)

    def overlaps(
        self, shape: Shape, pose: Pose | None = None, *, bounds_only: bool = False
    ) -> tuple[tuple[str, str], ...]:
        """Robot and link of all that overlap a shape; with `bounds_only` those whose boxes along the world's axes meet
        that of the shape."""
        request = proto.FindOverlapsRequest(
            shape=shape.message, pose=None if pose is None else pose_to_proto(pose), bounds_only=bounds_only
        )
        links = self.call(methods.FindOverlaps, request).links
        return tuple((each.robot, each.link) for each in links)

    def cast_shape(self, shape: Shape, translation: npt.ArrayLike, pose: Pose | None = None) -> RayHits:
        """What a shape meets first that goes by `translation` from a pose, without turning: one hit."""
        way = vector_to_proto(translation, "a translation")
        request = proto.CastShapeRequest(
            shape=shape.message, pose=None if pose is None else pose_to_proto(pose), translation=way
        )
        hit = self.call(methods.CastShape, request).hit
        start = Pose() if pose is None else pose
        end = np.asarray(start.position) + vector_from_proto(way)
        return hits_from_proto([hit], end[None, :])

    def link_bounds(self, *robots: str | Named) -> tuple[LinkBounds, ...]:
        """The boxes around the shapes of links, along the world's axes: of these robots, or of all. Links that touch
        nothing have none, nor have planes."""
        request = proto.GetLinkBoundsRequest(robots=[name_of(robot) for robot in robots])
        return bounds_from_proto(self.call(methods.GetLinkBounds, request).links)

    def asset(self, sha256: str) -> bytes:
        """The content of a file that a robot's scene refers to."""
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
        beyond_limit: BeyondLimit = "clamp",
        timeout: float | None = None,
    ) -> States:
        """Does so many steps of a world that is not playing, as fast as possible, in one round trip; after
        `join_lockstep`, once the other members have asked too.

        `targets`, by robot, apply from the first of the steps on: see `Robot.set_targets` for their form.
        With `states` the answer has the states after the last step, of all robots or of a selection (a robot,
        several, or joints by robot); with `link_states` it also has those of their links, in `links`, and with
        `contacts` the contact points in which they take part. The default `timeout` is the connection's and 0.01 s per step. Raises `WrongState` while the world plays, and
        `Superseded` if a play, pause or reset interrupts the steps.
        """
        messages, claim = self._encode_targets(targets or {})
        wanted = link_states or contacts or (states is not False and states is not None)
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
        found = self.decode_states(answer.states, selected, clamped)
        links = {each.robot: link_states_from_proto(each, found.stamp) for each in answer.link_states}
        touching = contacts_from_proto(answer.contacts)
        return replace(found, links=links, contacts=touching) if links or touching else found

    def join_lockstep(self, timeout: float = 10.0) -> Lockstep:
        """Makes this client one of those that step the world together: from then on only they step it, `step` waits for
        the others, and the world does not play. A member that takes longer than `timeout` seconds (0.01 to 3,600) from one step to
        asking for the next is one no more."""
        answer = self.call(methods.JoinLockstep, proto.JoinLockstepRequest(timeout=timeout))
        self._cache.lockstep_member = answer.member
        # Each of them, also one that is still to come, may take its time before each step.
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
        """Resets the world: `time` to zero, the `state` of robots to that with which they were spawned; `spawned`
        removes the robots that clients spawned. Without arguments it resets time and state."""
        request = proto.ResetSimulationRequest(time=time, state=state, spawned=spawned)
        return stamp_from_proto(self.call(methods.ResetSimulation, request).stamp)

    @property
    def state(self) -> SimulationState:
        """Whether the world plays, is paused or is stopped."""
        return state_from_proto(self._get_state().state)

    @property
    def stamp(self) -> Stamp:
        """The moment of the newest state."""
        return stamp_from_proto(self._get_state().stamp)

    @property
    def physics(self) -> Physics:
        """Gravity, time step, substeps, pace, integrator."""
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
    ) -> Physics:
        """Changes only what is given (m/s^2, s). Raises `InvalidValue` and changes nothing if a value is refused."""
        request = proto.SetPhysicsRequest(
            gravity=None if gravity is None else vector_to_proto(gravity, "gravity"),
            time_step=time_step,
            substeps=substeps,
            real_time_factor=real_time_factor,
            pace=None if pace is None else pace_to_proto(pace),
            integrator=None if integrator is None else integrator_to_proto(integrator),
        )
        return physics_from_proto(self.call(methods.SetPhysics, request).physics)

    # States over time.

    def watch(self, rate: float | None = None, selection: Selection = None) -> WorldWatch:
        """States of all robots, all of one moment; the newest wins. Each step if the reader keeps up, at
        most `rate` per wall second. The first is the current one. One round trip each."""
        return WorldWatch(self, rate, selection)

    def on_states(
        self, function: Callable[[States], object], rate: float | None = None, selection: Selection = None
    ) -> Callbacks[States]:
        """Calls a function with the current states, and with newer ones, as `watch` gives them."""
        return Callbacks(self._link, self.watch(rate, selection), function)

    def on_event(
        self, function: Callable[[Event], object], *kinds: str, after: int | None = None
    ) -> Callbacks[Event]:
        """Calls a function with each event from now on, or after a sequence, or with those of some kinds:
        `entity_spawned`, `simulation_reset` and so on, as in `Event.kind`."""
        return Callbacks(self._link, SomeEvents(self.events(after), kinds), function)

    def events(self, after: int | None = None) -> EventWatch:
        """Events from now on, or after a sequence: 0 gives all that the daemon still keeps."""
        begin = next_events(self, 0, 0.0)[1] if after is None else after
        return EventWatch(self, begin)

    @property
    def statistics(self) -> WorldStatistics:
        """How well the world keeps time. It never waits for a step, so that it also serves as a ping."""
        answer = self.call(methods.GetWorldStatistics, proto.GetWorldStatisticsRequest())
        return statistics_from_proto(answer.statistics)

    def watch_statistics(self, rate: float | None = None) -> Watch[WorldStatistics]:
        """Statistics as they are published, ten times a second; the newest wins."""
        return _StatisticsWatch(self, rate)

    # Everything else.

    @property
    def constraints(self) -> Constraints:
        """What holds links together beside the joints of their robots."""
        return Constraints(self)

    @property
    def parameters(self) -> Parameters:
        """Sliders and buttons that programs add and people use."""
        return Parameters(self)

    def info(self) -> SimulatorInfo:
        """The daemon's versions, limits and features."""
        return info_from_proto(self.call(methods.GetSimulatorInfo, proto.GetSimulatorInfoRequest()))

    def record(
        self,
        name: str = "",
        *,
        rate: float = 100.0,
        keep_last: float = 0.0,
        max_bytes: int = 0,
        max_duration: float = 0.0,
    ) -> Recording:
        """Begins a recording on the daemon's disk: every command from now on, and joint states and link poses at `rate` in a
        simulated second (0: none). It can be used in a `with` block, which ends it.

        With `keep_last`, only so many seconds are kept, in several files; it ends at `max_bytes` or after `max_duration`
        seconds, of which 0 is no limit. Raises `RecordingNotPossible`, `RecordingExists`, `InvalidValue`.
        """
        request = proto.StartRecordingRequest(
            name=name, state_rate=rate, keep_last=keep_last, max_bytes=max_bytes, max_duration=max_duration
        )
        answer = self.call(methods.StartRecording, request)
        return Recording(self, recording_from_proto(answer.recording))

    def recordings(self) -> tuple[RecordingInfo, ...]:
        """The recordings on the daemon's disk, by name."""
        answer = self.call(methods.ListRecordings, proto.ListRecordingsRequest())
        return tuple(recording_from_proto(each) for each in answer.recordings)

    def delete_recording(self, name: str) -> None:
        """Deletes the files of a recording. Raises `RecordingNotFound`."""
        self.call(methods.DeleteRecording, proto.DeleteRecordingRequest(name=name))

    def save_state(self, name: str = "", *, take_over: bool = False) -> SavedState:
        """Saves the state of the world in the daemon's memory. The daemon chooses a name if none is given. Raises
        `OwnedByAnother` if it would replace another client's, unless `take_over`: where the daemon asks for tokens, that
        needs an admin's."""
        answer = self.call(methods.SaveState, proto.SaveStateRequest(name=name, take_over=take_over))
        return saved_state_from_proto(answer.saved_state)

    def restore_state(self, saved_state: str | SavedState) -> Stamp:
        """Restores a saved state. Raises `SavedStateNotFound`."""
        request = proto.RestoreStateRequest(name=_name(saved_state))
        return stamp_from_proto(self.call(methods.RestoreState, request).stamp)

    def export_saved_state(self, saved_state: str | SavedState, path: AnyPath) -> Path:
        """Writes a saved state, with the descriptions and meshes of its robots, into a file on this disk; a file
        at the path is replaced. Raises `SavedStateNotFound`, and `LimitExceeded` for more than 128 MiB of meshes."""
        request = proto.ExportSavedStateRequest(name=_name(saved_state))
        answer = self.call(methods.ExportSavedState, request, wait=FILE_SECONDS)
        write_file(self, answer.sha256, Path(path))
        return Path(path)

    def import_saved_state(
        self, path: AnyPath, name: str = "", *, take_over: bool = False
    ) -> SavedState:
        """Reads such a file into the daemon's memory. After `restore_state` the world continues bit for bit as
        the one that was exported, on the same release and machine. By default the saved state keeps its name.
        Raises `InvalidSavedState`, and `OwnedByAnother` as `save_state` does."""
        sha256 = send_saved_state(self, Path(path))
        request = proto.ImportSavedStateRequest(sha256=sha256, name=name, take_over=take_over)
        answer = self.call(methods.ImportSavedState, request, wait=FILE_SECONDS)
        return saved_state_from_proto(answer.saved_state)

    def saved_states(self) -> list[SavedState]:
        """The saved states, oldest first."""
        answer = self.call(methods.ListSavedStates, proto.ListSavedStatesRequest())
        return [saved_state_from_proto(each) for each in answer.saved_states]

    def delete_saved_state(self, saved_state: str | SavedState, *, take_over: bool = False) -> None:
        """Deletes a saved state. Raises `SavedStateNotFound`, and `OwnedByAnother` as `save_state` does."""
        request = proto.DeleteSavedStateRequest(name=_name(saved_state), take_over=take_over)
        self.call(methods.DeleteSavedState, request)

    def _get_state(self) -> proto.GetSimulationStateResponse:
        return self.call(methods.GetSimulationState, proto.GetSimulationStateRequest())

    def _set_state(self, wanted: SimulationState) -> Stamp:
        request = proto.SetSimulationStateRequest(state=state_to_proto(wanted))
        return stamp_from_proto(self.call(methods.SetSimulationState, request).stamp)


class Robots(dict[str, Robot]):
    """Robots by their names."""

    def __missing__(self, name: str) -> Robot:
        message = f"there is no robot `{name}` in this world; there are {listed(self)}"
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


def _name(saved_state: str | SavedState) -> str:
    return saved_state if isinstance(saved_state, str) else saved_state.name
