"""Plots of joint states, with matplotlib, an optional extra of this package (`extras.PLOT`)."""

from __future__ import annotations

import importlib
import io
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from simd_client import extras
from simd_client.layout import JointType
from simd_client.state import RobotState

QUANTITIES = ("position", "velocity", "effort", "target")
"""Quantities that can be plotted."""

MAX_STATES = 100_000
"""Maximum number of states in one plot."""

_UNITS = {
    "position": ("rad", "m"),
    "velocity": ("rad/s", "m/s"),
    "effort": ("N m", "N"),
    "target": ("", ""),
}


def plotted(
    states: Iterable[RobotState], what: Sequence[str], joints: Sequence[str] | None, axes: Any = None
) -> Any:
    """Returns a `matplotlib.figure.Figure` with one diagram for each quantity over simulated time, and a line
    for each joint.

    `joints` defaults to all of one axis. `axes` are the caller's diagrams, one for each quantity. Raises
    `ValueError` without states or for an unknown quantity, and `ImportError` without matplotlib.
    """
    for each in what:
        if each not in QUANTITIES:
            raise ValueError(f"there is no `{each}` to plot; there are {', '.join(QUANTITIES)}")
    rows = list(states)
    if not rows or not what:
        raise ValueError("there is nothing to plot")
    layout = rows[0].layout
    lines = tuple(joints) if joints is not None else tuple(each.name for each in layout.moving if each.dof == 1)
    times = np.array([state.stamp.sim_time for state in rows])
    if axes is None:
        try:
            make: Any = importlib.import_module("matplotlib.figure").Figure
        except ImportError as missing:
            raise ImportError(f"plots need matplotlib: {extras.PLOT}") from missing
        # Pyplot would keep each figure and choose a window.
        figure = _shown_in_notebooks(make)(figsize=(8, 0.6 + 2.2 * len(what)), layout="constrained")
        axes = figure.subplots(len(what), 1, sharex=True, squeeze=False)[:, 0]
    diagrams = list(np.atleast_1d(np.asarray(axes, dtype=object)).ravel())
    if len(diagrams) != len(what):
        raise ValueError(f"{len(what)} quantities are plotted on as many axes, not on {len(diagrams)}")
    turning = (JointType.REVOLUTE, JointType.CONTINUOUS)
    for diagram, quantity in zip(diagrams, what):
        for joint in lines:
            values = [getattr(state[joint], quantity) for state in rows]
            diagram.plot(times, values, label=joint)
        units = sorted({_UNITS[quantity][layout.by_name[joint].type not in turning] for joint in lines} - {""})
        diagram.set_ylabel(f"{quantity} [{', '.join(units)}]" if units else quantity)
        diagram.grid(True, alpha=0.3)
    diagrams[-1].set_xlabel("simulated time [s]")
    diagrams[0].set_title(rows[0].robot)
    if lines:
        diagrams[0].legend(loc="best", fontsize="small")
    return diagrams[0].figure


def _shown_in_notebooks(figure: Any) -> Any:
    """Returns the class of figures with a notebook's display method: without pyplot nothing draws them
    there."""

    def png(self: Any) -> bytes:
        content = io.BytesIO()
        self.savefig(content, format="png")
        return content.getvalue()

    return type("Figure", (figure,), {"_repr_png_": png})
