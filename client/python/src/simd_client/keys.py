"""The key expressions of a daemon on Zenoh: the client's half of `proto/src/keys.rs`."""

from __future__ import annotations

ALL_DAEMONS = "@simd/daemons/*/*"
"""Liveliness tokens of all daemons."""


def rpc(daemon: str, method: str) -> str:
    """The key of the queries for `SERVICE/METHOD`."""
    return f"simd/{daemon}/rpc/{method}"


def joint_states(daemon: str, robot: str) -> str:
    """The key under which a robot's joint states are published."""
    return f"simd/{daemon}/joint_states/{robot}"


def world_statistics(daemon: str) -> str:
    """The key under which the world's statistics are published."""
    return f"simd/{daemon}/world_statistics"


def parameters(daemon: str) -> str:
    """The key under which changed parameters are published."""
    return f"simd/{daemon}/parameters"


def joint_targets(daemon: str) -> str:
    """The key on which the daemon takes targets without an answer."""
    return f"simd/{daemon}/joint_targets"


def daemon_of(token: str) -> str | None:
    """The daemon's name in a liveliness token."""
    parts = token.split("/")
    return parts[2] if len(parts) == 4 and parts[:2] == ["@simd", "daemons"] else None
