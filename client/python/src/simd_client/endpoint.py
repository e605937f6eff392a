"""Parses the address of a daemon: `tcp/HOST:PORT`, with `#NAME` if there are several, or `embedded`."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass

from simd_client.errors import EndpointError

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
"""The default address of a daemon."""

DEFAULT_NAME = "simd"
"""The default name of a daemon."""

ENVIRONMENT = "SIMD_ENDPOINT"
"""The environment variable with the endpoint, unless the program gives one."""

EMBEDDED = "embedded"
"""The endpoint of a world in this process."""

TIMEOUT = 10.0
"""Seconds that calls wait for their answer, by default."""

CONNECT_TIMEOUT = 3.0
"""Seconds that connecting may take, by default."""


_WITH_PORT = ("tcp", "tls", "udp", "quic", "ws")


@dataclass(frozen=True)
class Endpoint:
    """A Zenoh locator, and the name of a daemon that is reached through it."""

    locator: str
    """`PROTOCOL/ADDRESS`, or `embedded`."""
    name: str | None = None
    """`None` if it was not given: the only daemon there, else `simd`."""

    @property
    def is_embedded(self) -> bool:
        """Whether it is a world in this process."""
        return self.locator == EMBEDDED

    def __str__(self) -> str:
        return self.locator if self.name is None else f"{self.locator}#{self.name}"


def is_name(text: str) -> bool:
    """Whether it is a valid name of a daemon or a robot."""
    return re.fullmatch(r"[A-Za-z0-9_-]+", text) is not None


def read_endpoint(text: str | None, name: str | None = None) -> Endpoint:
    """The endpoint of `text`, else of `$SIMD_ENDPOINT`, else `tcp/127.0.0.1:7447`.

    `name` takes precedence over one after `#`.
    """
    text = text or os.environ.get(ENVIRONMENT) or DEFAULT_ENDPOINT
    locator, _, suffix = text.strip().partition("#")
    if locator != EMBEDDED and re.fullmatch(r"[a-z][a-z0-9_]*/[^\s/][^\s]*", locator) is None:
        raise EndpointError(
            f"`{text}` is not an endpoint: this client speaks Zenoh and takes PROTOCOL/ADDRESS, "
            f"for instance {DEFAULT_ENDPOINT}, or `{EMBEDDED}` for a world in this process"
        )
    protocol, _, address = locator.partition("/")
    if protocol in _WITH_PORT and re.search(r":\d+$", address.partition("?")[0]) is None:
        port = DEFAULT_ENDPOINT.rpartition(":")[2]
        raise EndpointError(f"`{text}` has no port: with the default one it is {locator.rstrip(':')}:{port}")
    name = name or suffix or None
    if name is not None and not is_name(name):
        raise EndpointError(f"`{name}` is not the name of a daemon: those have only A-Z, a-z, 0-9, _ and -")
    return Endpoint(locator, name)
