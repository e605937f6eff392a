"""A running daemon's world, as an object."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import TypeVar

import numpy.typing as npt

from simd_client import keys
from simd_client.claim import Claim
from simd_client.description import LoadReport
from simd_client.endpoint import Endpoint
from simd_client.link import Link
from simd_client.memory import Memory
from simd_client.method import Method, Reply, Request
from simd_client.parameters import Parameters
from simd_client.plan import Plan, ask
from simd_client.plans import contacts, joints, robots, snapshots
from simd_client.plans import simulation as plans
from simd_client.plans.contacts import Contact, RayHits
from simd_client.plans.joints import Selection
from simd_client.plans.robots import AnyPath, Loaded, Packages
from simd_client.primitives import Primitives
from simd_client.robot import Robot
from simd_client.state import Applied, Named, States, name_of
from simd_client.target import BeyondLimit, Targets
from simd_client.watch import SILENCE, EventWatch, Pacer, Source, Watch
from simd_client.world import Pace, Physics, SimulationState, SimulatorInfo, Snapshot, Stamp, WorldStatistics

Result = TypeVar("Result")

STEP_SECONDS = 0.01
"""How much longer a call may take for each step that it asks for, if nothing else is said."""


def statistics_source(daemon: str) -> Source[WorldStatistics]:
    """Where statistics are watched."""
    key = keys.world_statistics(daemon)
    # A world that stands still has statistics all the same.
    return Source(
        key, plans.published_statistics, plans.statistics, lambda statistics: statistics.stamp.sequence
    )


class Connection:
    """What is known of a connection without asking the daemon."""

    def __init__(self, link: Link, timeout: float, memory: Memory | None = None) -> None:
        self._link = link
        self._timeout = timeout
        self._memory = memory or Memory()

    @property
    def name(self) -> str:
        """What the daemon is called."""
        return self._link.name

    @property
    def endpoint(self) -> Endpoint:
        """Where it is reached."""
        return self._link.endpoint

    @property
    def timeout(self) -> float:
        """Seconds that calls wait for their answer."""
        return self._timeout

    @property
    def link(self) -> Link:
        """The connection itself."""
        return self._link

    @property
    def memory(self) -> Memory:
        """What the connection remembers of the world."""
        return self._memory

    def __repr__(self) -> str:
        return f"<Simulation '{self.name}' at {self.endpoint.locator}>"

    def _longer(self, steps: int, timeout: float | None) -> float:
        """How much longer than usual a call may take that asks for so many steps."""
        return steps * STEP_SECONDS if timeout is None else timeout - self._timeout


class Simulation(Connection, Primitives[Robot]):
    """A connection to one daemon. Make one by `simd_client.connect`, and use it with `with` or `close` it.

    May be used from several threads at once; iterators (`watch`, `events`) and claims belong to one.
    Calls raise a `SimdError`; each has a timeout.
    """

    def with_timeout(self, timeout: float) -> Simulation:
        """The same connection, with another time to wait for answers, in seconds."""
        return Simulation(self._link, timeout, self._memory)

    def run(self, plan: Plan[Result]) -> Result:
        """Does what a plan says."""
        return self._link.run(plan, self._timeout)

    def call(self, method: Method[Request, Reply], request: Request, *, wait: float = 0.0) -> Reply:
        """Any method of the schema (`simd_client.proto.methods`) with its message. `wait` is how long the
        daemon itself was told to wait, in seconds."""
        return self.run(ask(method, request, wait))

    def close(self) -> None:
        """Ends the connection. Robots and targets stay; claims that were not released lapse."""
        self._link.close()

    def __enter__(self) -> Simulation:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    # Robots.

    def _loaded(self, plan: Plan[Loaded]) -> Robot:
        loaded = self.run(plan)
        return Robot(self, loaded.info, loaded.report)

    def validate(
        self, path: AnyPath, *, scale: float | None = None, packages: Packages | None = None
    ) -> LoadReport:
        """Reads a robot on this disk as `load` would, and only reports."""
        return self.run(robots.validate_file(path, packages, scale))

    @property
    def robots(self) -> dict[str, Robot]:
        """The robots in the world by name, in the order in which they came."""
        return {info.name: Robot(self, info) for info, _ in self.run(robots.all_existing(self._memory))}

    def robot(self, name: str) -> Robot:
        """One of them. Raises `RobotNotFound`."""
        return Robot(self, self.run(robots.existing(self._memory, name))[0])

    def contacts(self, robot: str | Named | None = None) -> tuple[Contact, ...]:
        """The points at which links touch, of the newest state: of all robots, or those in which one takes part."""
        return self.run(contacts.contacts("" if robot is None else name_of(robot)))

    def cast_rays(self, starts: npt.ArrayLike, ends: npt.ArrayLike) -> RayHits:
        """What straight lines meet first, of the newest state: one row a ray, metres, world axes; one start may
        do for all. A thousand go in one round trip."""
        return self.run(contacts.cast_rays(starts, ends))

    def asset(self, sha256: str) -> bytes:
        """The whole of a file that a robot's scene names."""
        return self.run(robots.asset(sha256))

    # Time.

    def step(
        self,
        steps: int = 1,
        targets: Targets | None = None,
        *,
        states: bool | Selection = False,
        link_states: bool = False,
        beyond_limit: BeyondLimit = "clamp",
        timeout: float | None = None,
    ) -> States:
        """Does so many steps of a world that does not play, as fast as it can: one round trip.

        `targets`, by robot, hold from the first of the steps: see `Robot.set_targets` for what they may be.
        With `states` the answer has the states after the last step: of all robots, or of what is selected (a
        robot, several, or joints by robot), and with `link_states` those of their links in `links`. `timeout` is the connection's and 0.01 s for each step where it is
        left out. Raises `WrongState` while playing, `Superseded` where a play, pause or reset came between.
        """
        wait = self._longer(steps, timeout)
        return self.run(plans.step(self._memory, steps, targets, states, beyond_limit, wait, link_states))

    def play(self) -> Stamp:
        """Lets time run."""
        return self.run(plans.set_state(SimulationState.PLAYING))

    def pause(self) -> Stamp:
        """Lets time stand."""
        return self.run(plans.set_state(SimulationState.PAUSED))

    def stop(self) -> Stamp:
        """Pauses, and puts time and robots back to the start."""
        return self.run(plans.set_state(SimulationState.STOPPED))

    def reset(self, *, time: bool = False, state: bool = False, spawned: bool = False) -> Stamp:
        """Puts the world back: `time` to zero, robots' `state` to what they were spawned with; `spawned`
        takes out the robots that clients brought. Nothing given means time and state."""
        return self.run(plans.reset(time, state, spawned))[0]

    @property
    def state(self) -> SimulationState:
        """Whether the world runs."""
        return self.run(plans.state())[0]

    @property
    def stamp(self) -> Stamp:
        """The moment that the world is at."""
        return self.run(plans.state())[1]

    @property
    def physics(self) -> Physics:
        """Gravity, time step, substeps, pace."""
        return self.run(plans.physics())

    def set_physics(
        self,
        *,
        gravity: npt.ArrayLike | None = None,
        time_step: float | None = None,
        substeps: int | None = None,
        real_time_factor: float | None = None,
        pace: Pace | str | None = None,
    ) -> Physics:
        """Changes what is given and leaves the rest: m/s^2, s; all of it or, with `InvalidValue`, nothing."""
        return self.run(plans.set_physics(gravity, time_step, substeps, real_time_factor, pace))

    # States and targets.

    def states(self, selection: Selection = None) -> States:
        """The newest state, at once: of all robots, a robot, several, or joints by robot."""
        return self.run(joints.states(self._memory, selection))

    def next_states(self, after: Stamp | int = 0, wait: float = 1.0, selection: Selection = None) -> States:
        """The newest state once it is newer than `after`, or the one there is after `wait` seconds, at most 60."""
        sequence = after if isinstance(after, int) else after.sequence
        return self.run(joints.next_states(self._memory, sequence, wait, selection))

    def watch(self, rate: float | None = None, selection: Selection = None) -> Iterator[States]:
        """States of all robots, all of one moment, newest-wins: of each step where the reader keeps up, at
        most `rate` a wall second. The first is the one there is; one round trip each."""
        pace = Pacer(rate)
        time.sleep(pace.left())
        states = self.states(selection)
        while True:
            yield states
            before = states.stamp.sequence
            while states.stamp.sequence == before:
                time.sleep(pace.left())
                states = self.next_states(before, SILENCE, selection)

    def set_targets(self, targets: Targets, *, beyond_limit: BeyondLimit = "clamp") -> Applied:
        """Targets for several robots, all at one step, or none."""
        return self.run(joints.set_targets(self._memory, targets, beyond_limit))

    def exchange(
        self,
        targets: Targets,
        *,
        states: Selection = None,
        wait: float = 1.0,
        beyond_limit: BeyondLimit = "clamp",
    ) -> States:
        """A turn of a controller's loop on a world that plays: targets there, and the first state that was
        stepped with them back, in one round trip. After `wait` seconds the answer is the state there is (a
        paused world has no newer one); with 0 it comes at once. `states` selects, as in `states`."""
        return self.run(joints.exchange(self._memory, targets, states, wait, beyond_limit))

    def stream_targets(self, targets: Targets) -> None:
        """Sends targets without waiting for an answer, for controllers that send them at a rate. What is
        beyond a limit is clamped; a refusal is counted by the daemon and not told; under congestion a
        message may be dropped."""
        self._link.publish_targets(self.run(joints.streamed(self._memory, targets)))

    def claim(self, selection: Selection, *, holder: str = "", lease: float = 10.0) -> Claim:
        """Takes joints for this client, until the claim is released or was not used for `lease` seconds (0.1 to
        3,600). `holder` tells others who has them. Raises `JointClaimed` where another holds one."""
        held = self.run(joints.claim(self._memory, selection, holder or "simd_client", lease))
        return Claim(self._link, self._memory, held, self._timeout)

    # Everything else.

    @property
    def parameters(self) -> Parameters:
        """Sliders and buttons that programs put up and people move."""
        return Parameters(self._link, self._timeout)

    def events(self, after: int | None = None) -> EventWatch:
        """What happens from now on, or after that sequence: 0 is all that the daemon still keeps."""
        return EventWatch(self._link, after, self._timeout)

    @property
    def statistics(self) -> WorldStatistics:
        """How well the world keeps time. Also a ping: it never waits for a step."""
        return self.run(plans.statistics())

    def watch_statistics(self, rate: float | None = None) -> Watch[WorldStatistics]:
        """The same as it is published, ten times a second, newest-wins."""
        return Watch(self._link, statistics_source(self._link.name), rate, self._timeout)

    def info(self) -> SimulatorInfo:
        """Who answers: versions, limits, features."""
        return self.run(plans.info())

    def save_snapshot(self, name: str = "") -> Snapshot:
        """Keeps the state of the world in the daemon's memory. An empty name lets the daemon make one up."""
        return self.run(plans.save_snapshot(name))

    def restore_snapshot(self, snapshot: str | Snapshot) -> Stamp:
        """Puts the world back to a kept state. Raises `SnapshotNotFound`."""
        return self.run(plans.restore_snapshot(snapshot_name(snapshot)))

    def export_snapshot(self, snapshot: str | Snapshot, path: AnyPath) -> Path:
        """Writes a kept state, with all that its robots are made of, into a file on this disk; one that is
        there is replaced. Raises `SnapshotNotFound`, and `LimitExceeded` for more than 128 MiB of meshes."""
        return self.run(snapshots.export(snapshot_name(snapshot), path))

    def import_snapshot(self, path: AnyPath, name: str = "") -> Snapshot:
        """Keeps the state of such a file in the daemon's memory: `restore_snapshot` goes there, and the world
        then runs equal to the bit to the one that was exported, on the same release and machine. An empty
        name leaves it the one that it had. Raises `InvalidSnapshot`."""
        return self.run(snapshots.import_(path, name))

    def snapshots(self) -> list[Snapshot]:
        """Those that are kept, oldest first."""
        return self.run(plans.snapshots())

    def delete_snapshot(self, snapshot: str | Snapshot) -> None:
        """Forgets a kept state. Raises `SnapshotNotFound`."""
        self.run(plans.delete_snapshot(snapshot_name(snapshot)))


def snapshot_name(snapshot: str | Snapshot) -> str:
    return snapshot if isinstance(snapshot, str) else snapshot.name
