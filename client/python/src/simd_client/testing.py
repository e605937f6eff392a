"""For tests of robots: waiting in simulated time, and assertions that say how far off a robot is.

    applied = arm.set_positions({"shoulder": 0.5})
    until(lambda: assert_positions(arm, {"shoulder": 0.5}, within=0.01, after=applied), timeout=2.0)

The fixtures of `simd_client.pytest` choose the world of `until`; other programs give it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Protocol, TypeVar

import numpy as np
import numpy.typing as npt

from simd_client.blocking.robot import Robot
from simd_client.blocking.simulation import Simulation
from simd_client.errors import Superseded, WrongState, refused_here
from simd_client.geometry import Pose, vector
from simd_client.layout import JointInfo, JointType
from simd_client.quantity import Quantity, number
from simd_client.state import JointState, RobotState
from simd_client.world import SimulationState, Stamp

__all__ = ["assert_efforts", "assert_link_at", "assert_positions", "assert_velocities", "until"]

Value = TypeVar("Value")

_NEWER = 1.0
"""Wall seconds without a newer state after which a playing world is asked whether it still plays."""

_UNITS = {"position": ("rad", "m"), "velocity": ("rad/s", "m/s"), "effort": ("N m", "N")}


class _Current:
    """The world of the running test."""

    sim: Simulation | None = None


class Stamped(Protocol):
    """A moment of the world: a state, or what a call that sets targets returns."""

    @property
    def stamp(self) -> Stamp:
        """Stamp of that moment."""
        ...


def use(sim: Simulation | None) -> None:
    """Chooses the world of `until`."""
    _Current.sim = sim


def until(
    condition: Callable[[], Value], timeout: float = 10.0, *, steps: int = 10, sim: Simulation | None = None
) -> Value:
    """Waits until `condition` returns a true value, and returns it. A paused world makes `steps` steps between
    two looks; a playing world is waited for. `timeout` is in simulated seconds.

    An `AssertionError` of the condition means "not yet", so assertions can be waited for. After the timeout it
    is raised, with the time added. Raises `AssertionError` also for a value that never became true, and
    `Superseded` if the world is reset. `sim` is the world, by default the one of the test's fixture `simd`.
    """
    __tracebackhide__ = True
    world = _Current.sim if sim is None else sim
    if world is None:
        raise ValueError("`until` has no world to step: give `sim=`, or use the fixture `simd`")
    if not timeout >= 0.0 or steps < 1:
        raise ValueError(f"until(timeout={timeout}, steps={steps}): a timeout is 0 or more seconds, and steps are 1 or more")
    begin = now = world.stamp
    plays = world.state is SimulationState.PLAYING
    while True:
        failed: AssertionError | None = None
        value: Value | None = None
        try:
            value = condition()
        except AssertionError as error:
            failed = error
        if failed is None and value:
            return value
        passed = now.sim_time - begin.sim_time
        # Half a step for the rounding of times.
        if passed >= timeout * (1.0 - 1e-9):
            raise _never(failed, value, passed) from failed
        now = _newer(world, now) if plays else world.step(steps).stamp
        if now.epoch != begin.epoch:
            raise refused_here(Superseded, "CANCELLED", "the world was reset or restored while `until` waited")


def _never(failed: AssertionError | None, value: object, passed: float) -> AssertionError:
    if failed is not None:
        said = str(failed) or "an assertion of the condition failed"
        return AssertionError(f"{said}\n(waited for it for {passed:.4g} simulated seconds)")
    advice = ": does the condition return its result?" if value is None else ""
    return AssertionError(f"within {passed:.4g} simulated seconds the condition did not become true, it is {value!r}{advice}")


def _newer(world: Simulation, now: Stamp) -> Stamp:
    """Returns the stamp of a newer state of a playing world."""
    while True:
        found = world.next_states(now, _NEWER, ()).stamp
        if found.sequence != now.sequence and (found.step, found.epoch) != (now.step, now.epoch):
            return found
        if world.state is not SimulationState.PLAYING:
            raise refused_here(WrongState, "FAILED_PRECONDITION", "the world was paused while `until` waited for it")


def assert_positions(
    robot: Robot, wanted: npt.ArrayLike | Mapping[str, Quantity], *, within: Quantity, after: Stamped | None = None
) -> RobotState:
    """Asserts that joints are `within` this distance of positions, as an array in joint order or by joint name,
    in rad, m or with units. Returns the state. `after` is the moment from which the message counts time, for
    instance `arm.set_positions(...)`."""
    __tracebackhide__ = True
    return _assert("position", robot, wanted, within, after)


def assert_velocities(
    robot: Robot, wanted: npt.ArrayLike | Mapping[str, Quantity], *, within: Quantity, after: Stamped | None = None
) -> RobotState:
    """Asserts velocities of joints, as `assert_positions` does."""
    __tracebackhide__ = True
    return _assert("velocity", robot, wanted, within, after)


def assert_efforts(
    robot: Robot, wanted: npt.ArrayLike | Mapping[str, Quantity], *, within: Quantity, after: Stamped | None = None
) -> RobotState:
    """Asserts efforts of joints, as `assert_positions` does."""
    __tracebackhide__ = True
    return _assert("effort", robot, wanted, within, after)


def assert_link_at(
    robot: Robot, link: str, wanted: npt.ArrayLike, *, within: Quantity, after: Stamped | None = None
) -> Pose:
    """Asserts that the origin of a link is `within` this distance of a place, metres and world axes. Returns its
    pose. An empty `link` is the root link."""
    __tracebackhide__ = True
    place, allowed = vector(wanted, 3, "a place"), number(within, "position")
    poses = robot.link_poses()
    name = link or robot.links[0]
    if name not in poses:
        raise ValueError(f"robot `{robot.name}` has no link `{name}`; it has {', '.join(poses)}")
    pose = poses[name]
    distance = float(np.linalg.norm(pose.position - place))
    if distance <= allowed:
        return pose
    at, to = (" ".join(_shown(each, allowed) for each in numbers) for numbers in (pose.position, place))
    raise AssertionError(
        f"link `{name}` of `{robot.name}` is at {at} m, {_shown(distance, allowed)} m from {to}, "
        f"wanted within {_shown(allowed, allowed)} m{_since(robot.read().stamp, after)}"
    )


def _assert(
    what: str,
    robot: Robot,
    wanted: npt.ArrayLike | Mapping[str, Quantity],
    within: Quantity,
    after: Stamped | None,
) -> RobotState:
    __tracebackhide__ = True
    state = robot.read()
    wrong: list[str] = []
    for joint, at, text in _wanted(what, state, wanted):
        allowed = number(within, what, joint)
        if not allowed > 0.0:
            raise ValueError(f"within={within!r} is no tolerance: it is above 0")
        found = state[joint.name]
        value = float(getattr(found, what))
        # A value that is not a number is never within.
        if not abs(value - at) <= allowed:
            wrong.append(_off(what, robot, joint, found, value, at, text, allowed))
    if wrong:
        raise AssertionError("; ".join(wrong) + _since(state.stamp, after))
    return state


def _wanted(
    what: str, state: RobotState, wanted: npt.ArrayLike | Mapping[str, Quantity]
) -> list[tuple[JointInfo, float, str]]:
    """Returns joints with their wanted numbers, and the text that gave each, if it was one."""
    layout = state.layout
    if isinstance(wanted, Mapping):
        if not wanted:
            raise ValueError(f"no joint of robot `{state.robot}` is given")
        named = {name: (state[name], quantity) for name, quantity in wanted.items()}
        return [
            (layout.by_name[name], number(quantity, what, layout.by_name[name]), str(quantity) if isinstance(quantity, str) else "")
            for name, (_, quantity) in named.items()
        ]
    joints = [joint for joint in layout.moving if joint.dof == 1]
    if len(joints) != len(layout.moving):
        raise ValueError(f"robot `{state.robot}` has joints with several axes: name the joints")
    values = vector(wanted, len(joints), f"a {what} of robot `{state.robot}`").tolist()
    return [(joint, value, "") for joint, value in zip(joints, values)]


def _off(
    what: str, robot: Robot, joint: JointInfo, found: JointState, value: float, at: float, text: str, allowed: float
) -> str:
    """Returns a sentence on a joint that is off."""
    unit = _UNITS[what][joint.type is JointType.PRISMATIC]
    is_at = {"position": "is at", "velocity": "moves at", "effort": "has"}[what]
    meant = f" ({text})" if text else ""
    blocks = f"; {found.blocked_by} blocks it" if found.blocked_by else ""
    return (
        f"joint `{joint.name}` of `{robot.name}` {is_at} {_shown(value, allowed)} {unit}, "
        f"wanted {_shown(at, allowed)}{meant} within {_shown(allowed, allowed)}{blocks}"
    )


def _shown(value: float, allowed: float) -> str:
    """Returns a number with one digit more than the tolerance needs."""
    if not math.isfinite(value):
        return str(value)
    digits = min(12, max(0, 1 - math.floor(math.log10(allowed)))) if allowed > 0.0 else 6
    text = f"{value:.{digits}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def _since(now: Stamp, after: Stamped | None) -> str:
    """Returns when it was."""
    if after is None or after.stamp.epoch != now.epoch:
        return f", at {now.sim_time:.6g} s"
    return f", {now.sim_time - after.stamp.sim_time:.6g} s after the target"
