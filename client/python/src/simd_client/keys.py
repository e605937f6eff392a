"""The key expressions of a daemon on Zenoh: the client's half of `proto/src/keys.rs`."""

from __future__ import annotations

import re

ALL_DAEMONS = "@simd/daemons/*/*"
"""Liveliness tokens of all daemons."""


def rpc(daemon: str, method: str) -> str:
    """The key of the queries for `SERVICE/METHOD`."""
    return f"simd/{daemon}/rpc/{method}"


def joint_states(daemon: str, robot: str) -> str:
    """The key under which a robot's joint states are published."""
    return f"simd/{daemon}/joint_states/{robot}"


def sensor_readings(daemon: str, robot: str, sensor: str) -> str:
    """The key under which a sensor's readings are published."""
    return f"simd/{daemon}/sensor_readings/{robot}/{sensor}"


def world_statistics(daemon: str) -> str:
    """The key under which the world's statistics are published."""
    return f"simd/{daemon}/world_statistics"


def parameters(daemon: str) -> str:
    """The key under which changed parameters are published."""
    return f"simd/{daemon}/parameters"


def joint_targets(daemon: str) -> str:
    """The key on which the daemon takes targets without an answer."""
    return f"simd/{daemon}/joint_targets"


def daemons_named(daemon: str) -> str:
    """Liveliness tokens of the daemons of one name; only one should exist."""
    return f"@simd/daemons/{daemon}/*"


def client(daemon: str, session: str) -> str:
    """Liveliness token that announces a client to its daemon."""
    return f"@simd/clients/{daemon}/{session}"


_TOKEN = re.compile(r"@simd/daemons/([A-Za-z0-9_-]{1,64})/([1-9a-f][0-9a-f]{0,31})")


def daemon_of(token: str) -> tuple[str, str] | None:
    """Returns the daemon's name and its session's id in a liveliness token; `None` for another key."""
    found = _TOKEN.fullmatch(token)
    return None if found is None else (found[1], found[2])
