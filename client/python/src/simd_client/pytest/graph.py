"""A graph of ROS 2 for nodes under test: a router of Zenoh in this process, and a daemon that is one of its nodes."""

from __future__ import annotations

import socket
from collections.abc import Mapping
from dataclasses import dataclass, field

import zenoh

_TRIES = 5


@dataclass(frozen=True)
class Graph:
    """The graph, for the nodes of a test."""

    router: str
    """Locator of its router, `tcp/127.0.0.1:PORT`."""
    environment: Mapping[str, str] = field(default_factory=dict[str, str])
    """Variables with which a node joins it: `subprocess.Popen(..., env={**os.environ, **graph.environment})`."""


class Router:
    """A router of Zenoh on a free port of this machine, with the settings of `rmw_zenohd`."""

    def __init__(self) -> None:
        self._session, port = _opened()
        locator = f"tcp/127.0.0.1:{port}"
        self.graph = Graph(
            locator,
            {
                "RMW_IMPLEMENTATION": "rmw_zenoh_cpp",
                "ZENOH_CONFIG_OVERRIDE": f'connect/endpoints=["{locator}"]',
                "ROS_DOMAIN_ID": "0",
            },
        )

    @property
    def settings(self) -> dict[str, object]:
        """The daemon's configuration for this graph."""
        return {"ros2.enabled": True, "ros2.router": self.graph.router, "ros2.domain_id": 0}

    def close(self) -> None:
        """Ends it."""
        self._session.close()  # pyright: ignore[reportUnknownMemberType]


def _opened() -> tuple[zenoh.Session, int]:
    for attempt in range(_TRIES):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port: int = free.getsockname()[1]
        settings = zenoh.Config()
        for name, value in {
            "mode": '"router"',
            "listen/endpoints": f'["tcp/127.0.0.1:{port}"]',
            "scouting/multicast/enabled": "false",
            "routing/router/peers_failover_brokering": "false",
        }.items():
            settings.insert_json5(name, value)  # pyright: ignore[reportUnknownMemberType]
        try:
            return zenoh.open(settings), port
        except zenoh.ZError:
            # Another program has taken the port since.
            if attempt == _TRIES - 1:
                raise
    raise AssertionError
