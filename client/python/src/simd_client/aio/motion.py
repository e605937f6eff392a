"""Robot motion that takes time: moves to a goal and waits until it is reached."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy.typing as npt

from simd_client import proto
from simd_client.aio.kinematics import Kinematics
from simd_client.aio.runtime import in_thread
from simd_client.errors import AnswerError, DeadlineExceeded, Superseded, WrongState, refused_here
from simd_client.motion import Goal, moves_to
from simd_client.plots import MAX_STATES, plotted
from simd_client.proto import methods
from simd_client.quantity import Quantity
from simd_client.selection import selections_to_proto
from simd_client.state import RobotState
from simd_client.world import SimulationState, Stamp, state_from_proto

NEWER = 1.0
"""Seconds without a newer state after which the world is asked whether it still plays."""


class Motion(Kinematics):
    """The part of a robot that waits for its motion. Timeouts are simulated seconds: a motion takes the same
    number on slow and fast machines."""

    async def move_to(
        self,
        positions: npt.ArrayLike | Mapping[str, Quantity],
        *,
        timeout: float = 10.0,
        tolerance: float = 0.01,
        velocity_tolerance: float = 0.05,
        max_velocity: float | None = None,
        steps: int = 0,
    ) -> RobotState:
        """Moves to these positions, as an array in joint order or by joint name, and returns the state in
        which the joints have arrived. Then they are no further away than `tolerance` (rad or m) and no faster
        than `velocity_tolerance` (rad/s or m/s). They stay there. A position beyond a limit is clamped to it.
        `max_velocity` limits each joint's velocity on the way.

        The world must play. With `steps` it must be paused, and this makes that many steps per round trip
        until the robot arrives: the same steps in each run.

        Raises `DeadlineExceeded`, naming the furthest joint, if the robot has not arrived within `timeout`
        simulated seconds; the robot continues to move. Raises `WrongState` if the world does not play, and
        `Superseded` if it is reset.
        """
        layout = await self._connection.layout(self.name)
        goal, targets = moves_to(layout, positions, max_velocity, tolerance, velocity_tolerance)
        applied = await self._connection.set_targets({self.name: targets})
        goal.clamp(applied.clamped)
        return await self._until(goal.is_reached, timeout, steps, goal)

    async def wait_until(
        self, condition: Callable[[RobotState], bool], *, timeout: float = 10.0, steps: int = 0
    ) -> RobotState:
        """Returns the first state for which `condition` is true, beginning with the current one. The
        condition gets the newest state, and not each step. `timeout`, `steps` and the errors are the same as
        for `move_to`."""
        return await self._until(condition, timeout, steps, None)

    async def plot(
        self,
        states: Iterable[RobotState] | None = None,
        *,
        seconds: float = 2.0,
        what: Sequence[str] = ("position", "velocity", "effort"),
        joints: Sequence[str] | None = None,
        axes: Any = None,
    ) -> Any:
        """Plots states over simulated time: a `matplotlib.figure.Figure`, which a notebook shows. Needs
        `pip install 'matplotlib>=3.6'`.

        `states` are states that the caller has collected, for instance from `Simulation.step`. Without them
        this watches the robot for `seconds` simulated seconds of a playing world; raises `WrongState` if it
        does not play. `what` selects from position, velocity, effort and target; `joints` selects joints, by
        default all. `axes` are the caller's diagrams, one for each quantity.
        """
        if states is None:
            states = await self._watched(seconds)
        shown = states
        return await in_thread(lambda: plotted(shown, what, joints, axes))

    async def _watched(self, seconds: float) -> list[RobotState]:
        """Yields the states of `seconds` simulated seconds as they arrive."""
        found: list[RobotState] = []

        def keep(state: RobotState) -> bool:
            found.append(state)
            return len(found) >= MAX_STATES or state.stamp.sim_time - found[0].stamp.sim_time >= seconds

        await self._until(keep, 2.0 * seconds + 1.0, 0, None)
        return found

    async def _until(
        self, condition: Callable[[RobotState], bool], timeout: float, steps: int, goal: Goal | None
    ) -> RobotState:
        if not timeout >= 0.0:
            raise ValueError(f"a timeout is a number of simulated seconds, not {timeout}")
        state = self._only((await self._connection.states(self.name)).robots)
        begin = state.stamp
        is_moving = False
        while not condition(state):
            now = state.stamp
            if now.epoch != begin.epoch:
                message = f"the world was reset or restored while robot `{self.name}` moved"
                raise refused_here(Superseded, "CANCELLED", message)
            if now.sim_time - begin.sim_time >= timeout:
                why = goal.missed(state) if goal else "the condition did not come true"
                raise DeadlineExceeded(f"robot `{self.name}`, within {timeout:g} simulated seconds: {why}")
            if steps == 0 and not is_moving:
                await self._check_playing()
            state = await self._later(now, steps)
            is_moving = state.stamp.sequence != now.sequence
        return state

    async def _later(self, now: Stamp, steps: int) -> RobotState:
        """Returns a newer state: the next one of a playing world, or the state after `steps` steps."""
        if steps == 0:
            return self._only((await self._connection.next_states(now, NEWER, self.name)).robots)
        request = proto.StepSimulationRequest(
            steps=steps, return_states=True, selections=selections_to_proto(self.name)
        )
        # The timeout per step is the same as in `Simulation.step`.
        answer = await self._connection.call(methods.StepSimulation, request, wait=steps * 0.01)
        return self._only((await self._connection.decode_states(answer.states)).robots)

    async def _check_playing(self) -> None:
        """Raises `WrongState` if the world is paused: nothing moves then."""
        answer = await self._connection.call(methods.GetSimulationState, proto.GetSimulationStateRequest())
        state = state_from_proto(answer.state)
        if state is not SimulationState.PLAYING:
            message = f"the simulation is {state.value}, so that robot `{self.name}` does not move"
            raise refused_here(WrongState, "FAILED_PRECONDITION", f"{message}: play it, or give `steps`")

    def _only(self, robots: Mapping[str, RobotState]) -> RobotState:
        if self.name not in robots:
            raise AnswerError(f"the daemon's answer cannot be understood: it lacks robot `{self.name}`")
        return robots[self.name]

