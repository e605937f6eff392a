"""Robot motion that takes time: go somewhere and wait until it is there."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy.typing as npt

from simd_client import proto
from simd_client.aio.kinematics import Kinematics
from simd_client.aio.runtime import in_thread
from simd_client.errors import AnswerError, DeadlineExceeded, Superseded, WrongState, refused_here
from simd_client.motion import Goal, moves_to
from simd_client.plots import MOST_STATES, plotted
from simd_client.proto import methods
from simd_client.quantity import Quantity
from simd_client.selection import selections_to_proto
from simd_client.state import RobotState
from simd_client.world import SimulationState, Stamp, state_from_proto

NEWER = 1.0
"""Seconds after which a world that shows nothing newer is asked whether it still plays."""


class Motion(Kinematics):
    """The part of a robot that waits for its motion. Timeouts are simulated seconds: a motion takes as many of them on a
    slow machine as on a fast one."""

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
        """Goes to these positions, as an array in joint order or by joint name, and returns the state in which the joints
        are there: no further away than `tolerance` (rad or m) and no faster than `velocity_tolerance` (rad/s or
        m/s). They stay there. A position beyond a limit is the limit. `max_velocity` limits each joint's velocity on
        the way.

        The world has to play; with `steps` it has to be paused, and this does so many steps at a time until the robot is
        there: the same steps in each run.

        Raises `DeadlineExceeded` with the joint that is furthest away if the robot is not there within `timeout` simulated
        seconds (it goes on trying), `WrongState` if the world does not play, and `Superseded` if it is reset.
        """
        layout = await self._connection.layout(self.name)
        goal, targets = moves_to(layout, positions, max_velocity, tolerance, velocity_tolerance)
        applied = await self._connection.set_targets({self.name: targets})
        goal.clamp(applied.clamped)
        return await self._until(goal.is_reached, timeout, steps, goal)

    async def wait_until(
        self, condition: Callable[[RobotState], bool], *, timeout: float = 10.0, steps: int = 0
    ) -> RobotState:
        """The first state for which `condition` is true, beginning with the current one. It is given the newest state, and
        not each step. `timeout`, `steps` and the errors are those of `move_to`."""
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

        `states` are what the caller has collected, for instance from `Simulation.step`. Without them this watches the robot
        for so many simulated `seconds` of a world that plays; raises `WrongState` if it does not.
        `what` of position, velocity, effort and target is plotted, of all `joints` or of some; `axes` are diagrams of the
        caller's, one for each.
        """
        if states is None:
            states = await self._watched(seconds)
        shown = states
        return await in_thread(lambda: plotted(shown, what, joints, axes))

    async def _watched(self, seconds: float) -> list[RobotState]:
        """The states of so many simulated seconds, as they come."""
        found: list[RobotState] = []

        def keep(state: RobotState) -> bool:
            found.append(state)
            return len(found) >= MOST_STATES or state.stamp.sim_time - found[0].stamp.sim_time >= seconds

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
        """A newer state: the next one of a world that plays, or that after so many steps."""
        if steps == 0:
            return self._only((await self._connection.next_states(now, NEWER, self.name)).robots)
        request = proto.StepSimulationRequest(
            steps=steps, return_states=True, selections=selections_to_proto(self.name)
        )
        # As long as `Simulation.step` gives each step.
        answer = await self._connection.call(methods.StepSimulation, request, wait=steps * 0.01)
        return self._only((await self._connection.decode_states(answer.states)).robots)

    async def _check_playing(self) -> None:
        """Nothing moves in a world that is paused: raises `WrongState`."""
        answer = await self._connection.call(methods.GetSimulationState, proto.GetSimulationStateRequest())
        state = state_from_proto(answer.state)
        if state is not SimulationState.PLAYING:
            message = f"the simulation is {state.value}, so that robot `{self.name}` does not move"
            raise refused_here(WrongState, "FAILED_PRECONDITION", f"{message}: play it, or give `steps`")

    def _only(self, robots: Mapping[str, RobotState]) -> RobotState:
        if self.name not in robots:
            raise AnswerError(f"the daemon's answer cannot be understood: it lacks robot `{self.name}`")
        return robots[self.name]

