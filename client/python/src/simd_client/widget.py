"""A live panel of a robot in a notebook, with anywidget, an optional extra of this package
(`extras.NOTEBOOK`).

The daemon forbids embedding its page in another one. Otherwise another site could make a user move a robot
without noticing.
"""

from __future__ import annotations

import importlib
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from simd_client import extras
from simd_client.errors import SimdError
from simd_client.layout import JointInfo, JointType

if TYPE_CHECKING:
    from simd_client.blocking.robot import Robot
    from simd_client.state import RobotState

_SCRIPT = Path(__file__).with_name("panel.js")
# Range of a joint without limits: half a turn, or a metre.
_TURN, _SLIDE = math.pi, 1.0


def panel(robot: Robot, rate: float = 10.0) -> Any:
    """A widget with a slider for each joint of one axis that takes targets. It shows the joint's position,
    updated `rate` times per second, and its target, which the slider sets. A cell of a notebook shows it. It
    ends with `close()`, with the robot or with the connection.

    Raises `ImportError` without anywidget.
    """
    try:
        anywidget: Any = importlib.import_module("anywidget")
        traitlets: Any = importlib.import_module("traitlets")
    except ImportError as missing:
        raise ImportError(f"panels need anywidget: {extras.NOTEBOOK}") from missing
    joints = [joint for joint in robot.layout.joints if joint.dof == 1 and joint.is_actuated]
    names = [joint.name for joint in joints]

    def wire(kind: Any, value: Any) -> Any:
        return kind(value).tag(sync=True)

    traits: dict[str, Any] = {
        "__doc__": panel.__doc__,
        "_esm": _SCRIPT.read_text(),
        "robot": wire(traitlets.Unicode, robot.name),
        "joints": wire(traitlets.List, [_row(joint) for joint in joints]),
        "positions": wire(traitlets.List, []),
        "targets": wire(traitlets.List, []),
        "time": wire(traitlets.Float, 0.0),
        # Set by a slider: the joint's index, the value, and a number that differs each time.
        "wanted": wire(traitlets.List, []),
        "problem": wire(traitlets.Unicode, ""),
    }
    widget: Any = type("Panel", (anywidget.AnyWidget,), traits)()

    def show(state: RobotState) -> None:
        rows = [state[name] for name in names]
        with widget.hold_sync():
            widget.positions = [row.position for row in rows]
            widget.targets = [row.target if row.mode.name in ("POSITION", "HOLD") else row.position for row in rows]
            widget.time = state.stamp.sim_time

    def move(change: Any) -> None:
        if not change["new"]:
            return
        index, value, _ = change["new"]
        try:
            robot.set_positions({names[int(index)]: float(value)})
            widget.problem = ""
        except (SimdError, ValueError, IndexError) as problem:
            widget.problem = str(problem)

    widget.observe(move, "wanted")
    show(robot.read())
    callbacks = robot.on_state(show, rate=rate)
    close = widget.close

    def end() -> None:
        callbacks.close()
        close()

    widget.close = end
    return widget


def _row(joint: JointInfo) -> dict[str, Any]:
    turns = joint.type in (JointType.REVOLUTE, JointType.CONTINUOUS)
    reach = _TURN if turns else _SLIDE
    lower, upper = joint.limits.lower, joint.limits.upper
    return {
        "name": joint.name,
        "lower": -reach if lower is None else lower,
        "upper": reach if upper is None else upper,
        "unit": "rad" if turns else "m",
    }
