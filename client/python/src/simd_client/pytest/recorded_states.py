"""Joint states in a recording, for plots. Needs the package `mcap-ros2-support`, of the extra `test`."""

from __future__ import annotations

import importlib
from collections import deque
from pathlib import Path
from typing import Any

from simd_client import extras, proto
from simd_client.layout import Layout
from simd_client.plots import MAX_STATES
from simd_client.state import RobotState
from simd_client.world import Stamp

ENDING = ".mcap"
"""How names of recordings end."""

_TOPIC = "joint_states"


def last_states(file: Path, layouts: dict[str, Layout], seconds: float) -> dict[str, list[RobotState]]:
    """Returns the states of the last `seconds` simulated seconds of a recording, by robot. Robots without a layout
    are left out, and so are those whose joints have other names there. An unfinished recording is read as far as
    it goes.

    Raises `ImportError` without the packages that read MCAP.
    """
    try:
        reader: Any = importlib.import_module("mcap.reader")
        decoders: Any = importlib.import_module("mcap_ros2.decoder")
        broken: Any = importlib.import_module("mcap.exceptions").McapError
    except ImportError as missing:
        raise ImportError(f"a recording is read by mcap-ros2-support: {extras.TEST}") from missing
    robots = {f"/{_topic(name)}/{_TOPIC}": layout for name, layout in layouts.items()}
    found = {layout.robot: deque[RobotState](maxlen=MAX_STATES) for layout in robots.values()}
    with file.open("rb") as stream:
        read = reader.make_reader(stream, decoder_factories=[decoders.DecoderFactory()])
        try:
            for _, channel, _, message in read.iter_decoded_messages(topics=list(robots)):
                state = _state(message, robots[channel.topic])
                if state is None:
                    continue
                states = found[state.robot]
                now = state.stamp.sim_time
                # Time goes back with a reset.
                while states and not now - seconds <= states[0].stamp.sim_time <= now:
                    states.popleft()
                states.append(state)
        except broken:
            # The end of an unfinished file.
            pass
    return {robot: list(states) for robot, states in found.items() if states}


def _state(message: Any, layout: Layout) -> RobotState | None:
    """Converts a `sensor_msgs/JointState`."""
    names = tuple(message.name)
    if any(name not in layout.by_name or layout.by_name[name].dof != 1 for name in names):
        return None
    time = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
    values = proto.RobotJointStates(
        robot=layout.robot,
        layout_version=layout.version,
        position=message.position,
        velocity=message.velocity,
        effort=message.effort,
    )
    return RobotState(values, Stamp(0, 0, time, 0, None), layout, names)


def _topic(robot: str) -> str:
    """Returns a robot's name as it stands in topics."""
    return robot.replace("-", "_")
