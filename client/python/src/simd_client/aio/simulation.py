"""A running daemon's world, for asyncio."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path
from types import TracebackType
from typing import TypeVar

import numpy.typing as npt

from simd_client.aio.claim import Claim
from simd_client.aio.parameters import Parameters
from simd_client.aio.robot import Robot
from simd_client.aio.runner import Answer, run
from simd_client.aio.watch import EventWatch, Watch
from simd_client.description import LoadReport
from simd_client.method import Method, Reply, Request
from simd_client.plan import Plan, ask
from simd_client.plans import contacts, joints, robots, snapshots
from simd_client.plans import simulation as plans
from simd_client.plans.contacts import Contact, RayHits
from simd_client.plans.joints import Selection
from simd_client.plans.robots import AnyPath, Loaded, Packages
from simd_client.primitives import Primitives
from simd_client.simulation import Connection, snapshot_name, statistics_source
from simd_client.state import Applied, Named, States, name_of
from simd_client.target import BeyondLimit, Targets
from simd_client.watch import SILENCE, Pacer
from simd_client.world import Pace, Physics, SimulationState, SimulatorInfo, Snapshot, Stamp, WorldStatistics

Result = TypeVar("Result")


class Simulation(Connection, Primitives["Answer[Robot]"]):
    """See `simd_client.Simulation`: the same names, and whatever asks the daemon is awaited, properties too:
    `await sim.state`. Make one by `async with simd_client.aio.connect() as sim`. Belongs to one event loop.
    """

    def with_timeout(self, timeout: float) -> Simulation:
        """The same connection, with another time to wait for answers, in seconds."""
        return Simulation(self._link, timeout, self._memory)

    def run(self, plan: Plan[Result]) -> Answer[Result]:
        """Does what a plan says."""
        return run(self._link, plan, self._timeout)

    def call(self, method: Method[Request, Reply], request: Request, *, wait: float = 0.0) -> Answer[Reply]:
        """Any method of the schema (`simd_client.proto.methods`) with its message. `wait` is how long the
        daemon itself was told to wait, in seconds."""
        return self.run(ask(method, request, wait))

    async def close(self) -> None:
        """Ends the connection. Robots and targets stay; claims that were not released lapse."""
        await asyncio.to_thread(self._link.close)

    async def __aenter__(self) -> Simulation:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()

    # Robots.

    async def _loaded(self, plan: Plan[Loaded]) -> Robot:
        loaded = await self.run(plan)
        return Robot(self, loaded.info, loaded.report)

    def validate(
        self, path: AnyPath, *, scale: float | None = None, packages: Packages | None = None
    ) -> Answer[LoadReport]:
        """Reads a robot on this disk as `load` would, and only reports."""
        return self.run(robots.validate_file(path, packages, scale))

    @property
    async def robots(self) -> dict[str, Robot]:
        """The robots in the world by name, in the order in which they came."""
        return {info.name: Robot(self, info) for info, _ in await self.run(robots.all_existing(self._memory))}

    async def robot(self, name: str) -> Robot:
        """One of them. Raises `RobotNotFound`."""
        return Robot(self, (await self.run(robots.existing(self._memory, name)))[0])

    def contacts(self, robot: str | Named | None = None) -> Answer[tuple[Contact, ...]]:
        """The points at which links touch, of the newest state: of all robots, or those in which one takes part."""
        return self.run(contacts.contacts("" if robot is None else name_of(robot)))

    def cast_rays(self, starts: npt.ArrayLike, ends: npt.ArrayLike) -> Answer[RayHits]:
        """What straight lines meet first, of the newest state: one row a ray, metres, world axes; one start may
        do for all. A thousand go in one round trip."""
        return self.run(contacts.cast_rays(starts, ends))

    def asset(self, sha256: str) -> Answer[bytes]:
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
    ) -> Answer[States]:
        """Does so many steps of a world that does not play, as fast as it can: one round trip.

        `targets`, by robot, hold from the first of the steps: see `Robot.set_targets` for what they may be.
        With `states` the answer has the states after the last step: of all robots, or of what is selected (a
        robot, several, or joints by robot), and with `link_states` those of their links in `links`. `timeout` is the connection's and 0.01 s for each step where it is
        left out. Raises `WrongState` while playing, `Superseded` where a play, pause or reset came between.
        """
        wait = self._longer(steps, timeout)
        return self.run(plans.step(self._memory, steps, targets, states, beyond_limit, wait, link_states))

    def play(self) -> Answer[Stamp]:
        """Lets time run."""
        return self.run(plans.set_state(SimulationState.PLAYING))

    def pause(self) -> Answer[Stamp]:
        """Lets time stand."""
        return self.run(plans.set_state(SimulationState.PAUSED))

    def stop(self) -> Answer[Stamp]:
        """Pauses, and puts time and robots back to the start."""
        return self.run(plans.set_state(SimulationState.STOPPED))

    async def reset(self, *, time: bool = False, state: bool = False, spawned: bool = False) -> Stamp:
        """Puts the world back: `time` to zero, robots' `state` to what they were spawned with; `spawned`
        takes out the robots that clients brought. Nothing given means time and state."""
        return (await self.run(plans.reset(time, state, spawned)))[0]

    @property
    async def state(self) -> SimulationState:
        """Whether the world runs."""
        return (await self.run(plans.state()))[0]

    @property
    async def stamp(self) -> Stamp:
        """The moment that the world is at."""
        return (await self.run(plans.state()))[1]

    @property
    def physics(self) -> Answer[Physics]:
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
    ) -> Answer[Physics]:
        """Changes what is given and leaves the rest: m/s^2, s; all of it or, with `InvalidValue`, nothing."""
        return self.run(plans.set_physics(gravity, time_step, substeps, real_time_factor, pace))

    # States and targets.

    def states(self, selection: Selection = None) -> Answer[States]:
        """The newest state, at once: of all robots, a robot, several, or joints by robot."""
        return self.run(joints.states(self._memory, selection))

    def next_states(
        self, after: Stamp | int = 0, wait: float = 1.0, selection: Selection = None
    ) -> Answer[States]:
        """The newest state once it is newer than `after`, or the one there is after `wait` seconds, at most 60."""
        sequence = after if isinstance(after, int) else after.sequence
        return self.run(joints.next_states(self._memory, sequence, wait, selection))

    async def watch(self, rate: float | None = None, selection: Selection = None) -> AsyncIterator[States]:
        """States of all robots, all of one moment, newest-wins: of each step where the reader keeps up, at
        most `rate` a wall second. The first is the one there is; one round trip each."""
        pace = Pacer(rate)
        await asyncio.sleep(pace.left())
        states = await self.states(selection)
        while True:
            yield states
            before = states.stamp.sequence
            while states.stamp.sequence == before:
                await asyncio.sleep(pace.left())
                states = await self.next_states(before, SILENCE, selection)

    def set_targets(self, targets: Targets, *, beyond_limit: BeyondLimit = "clamp") -> Answer[Applied]:
        """Targets for several robots, all at one step, or none."""
        return self.run(joints.set_targets(self._memory, targets, beyond_limit))

    def exchange(
        self,
        targets: Targets,
        *,
        states: Selection = None,
        wait: float = 1.0,
        beyond_limit: BeyondLimit = "clamp",
    ) -> Answer[States]:
        """A turn of a controller's loop on a world that plays: targets there, and the first state that was
        stepped with them back, in one round trip. After `wait` seconds the answer is the state there is (a
        paused world has no newer one); with 0 it comes at once. `states` selects, as in `states`."""
        return self.run(joints.exchange(self._memory, targets, states, wait, beyond_limit))

    async def stream_targets(self, targets: Targets) -> None:
        """Sends targets without waiting for an answer, for controllers that send them at a rate. What is
        beyond a limit is clamped; a refusal is counted by the daemon and not told; under congestion a
        message may be dropped."""
        self._link.publish_targets(await self.run(joints.streamed(self._memory, targets)))

    async def claim(self, selection: Selection, *, holder: str = "", lease: float = 10.0) -> Claim:
        """Takes joints for this client, until the claim is released or was not used for `lease` seconds (0.1 to
        3,600). `holder` tells others who has them. Raises `JointClaimed` where another holds one."""
        held = await self.run(joints.claim(self._memory, selection, holder or "simd_client", lease))
        return Claim(self._link, self._memory, held, self._timeout)

    # Everything else.

    @property
    def parameters(self) -> Parameters:
        """Sliders and buttons that programs put up and people move."""
        return Parameters(self._link, self._timeout)

    async def events(self, after: int | None = None) -> EventWatch:
        """What happens from now on, or after that sequence: 0 is all that the daemon still keeps."""
        begin = (await self.run(plans.events(0, 0.0)))[1] if after is None else after
        return EventWatch(self._link, begin, self._timeout)

    @property
    def statistics(self) -> Answer[WorldStatistics]:
        """How well the world keeps time. Also a ping: it never waits for a step."""
        return self.run(plans.statistics())

    def watch_statistics(self, rate: float | None = None) -> Watch[WorldStatistics]:
        """The same as it is published, ten times a second, newest-wins."""
        return Watch(self._link, statistics_source(self._link.name), rate, self._timeout)

    def info(self) -> Answer[SimulatorInfo]:
        """Who answers: versions, limits, features."""
        return self.run(plans.info())

    def save_snapshot(self, name: str = "") -> Answer[Snapshot]:
        """Keeps the state of the world in the daemon's memory. An empty name lets the daemon make one up."""
        return self.run(plans.save_snapshot(name))

    def restore_snapshot(self, snapshot: str | Snapshot) -> Answer[Stamp]:
        """Puts the world back to a kept state. Raises `SnapshotNotFound`."""
        return self.run(plans.restore_snapshot(snapshot_name(snapshot)))

    def export_snapshot(self, snapshot: str | Snapshot, path: AnyPath) -> Answer[Path]:
        """Writes a kept state, with all that its robots are made of, into a file on this disk; one that is
        there is replaced. Raises `SnapshotNotFound`, and `LimitExceeded` for more than 128 MiB of meshes."""
        return self.run(snapshots.export(snapshot_name(snapshot), path))

    def import_snapshot(self, path: AnyPath, name: str = "") -> Answer[Snapshot]:
        """Keeps the state of such a file in the daemon's memory: `restore_snapshot` goes there, and the world
        then runs equal to the bit to the one that was exported, on the same release and machine. An empty
        name leaves it the one that it had. Raises `InvalidSnapshot`."""
        return self.run(snapshots.import_(path, name))

    def snapshots(self) -> Answer[list[Snapshot]]:
        """Those that are kept, oldest first."""
        return self.run(plans.snapshots())

    async def delete_snapshot(self, snapshot: str | Snapshot) -> None:
        """Forgets a kept state. Raises `SnapshotNotFound`."""
        await self.run(plans.delete_snapshot(snapshot_name(snapshot)))
