"""Reads where a daemon is: `tcp/HOST:PORT`, and which one of those there with `#NAME`."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass

from simd_client.errors import EndpointError

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
"""Where a daemon listens if nothing else is said."""

DEFAULT_NAME = "simd"
"""What a daemon is called if nothing else is said."""

ENVIRONMENT = "SIMD_ENDPOINT"
"""The variable that names the endpoint where the program does not."""

TIMEOUT = 10.0
"""Seconds that calls wait for their answer, by default."""

CONNECT_TIMEOUT = 3.0
"""Seconds that connecting may take, by default."""


@dataclass(frozen=True)
class Endpoint:
    """A Zenoh locator, and the name of a daemon that is reached through it."""

    locator: str
    """`PROTOCOL/ADDRESS`."""
    name: str | None = None
    """`None` where it was not said: the only one there, else `simd`."""

    def __str__(self) -> str:
        return self.locator if self.name is None else f"{self.locator}#{self.name}"


def is_name(text: str) -> bool:
    """Whether a daemon or a robot can be called so."""
    return re.fullmatch(r"[A-Za-z0-9_-]+", text) is not None


def read_endpoint(text: str | None, name: str | None = None) -> Endpoint:
    """What a program says, else `$SIMD_ENDPOINT`, else `tcp/127.0.0.1:7447`.

    A `name` beside it wins over one after `#`.
    """
    text = text or os.environ.get(ENVIRONMENT) or DEFAULT_ENDPOINT
    locator, _, suffix = text.strip().partition("#")
    if re.fullmatch(r"[a-z][a-z0-9_]*/[^\s/][^\s]*", locator) is None:
        raise EndpointError(
            f"`{text}` is not an endpoint: this client speaks Zenoh and takes PROTOCOL/ADDRESS, "
            f"for instance {DEFAULT_ENDPOINT}"
        )
    name = name or suffix or None
    if name is not None and not is_name(name):
        raise EndpointError(f"`{name}` is not the name of a daemon: those have only A-Z, a-z, 0-9, _ and -")
    return Endpoint(locator, name)
