"""Parses the address of a daemon: `simd://HOST:PORT/NAME`, the address of its page, `tcp/HOST:PORT#NAME`, or `embedded`."""

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


_HTTP_PORT = 7400
_HTTP = re.compile(
    r"(?:(?P<scheme>simd|https?)://)?(?P<host>\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9_.-]+)(?::(?P<port>[0-9]+))?(?P<rest>/\S*)?"
)
_WITH_PORT = ("tcp", "tls", "udp", "quic", "ws")


@dataclass(frozen=True)
class Endpoint:
    """The address of a daemon, and its name."""

    locator: str
    """Locator of Zenoh, `PROTOCOL/ADDRESS`; `http://HOST:PORT` until the locator is known; or `embedded`."""
    name: str | None = None
    """Name of the daemon. `None` if it was not given: the only daemon there, else `simd`."""

    @property
    def is_embedded(self) -> bool:
        """Whether it is a world in this process."""
        return self.locator == EMBEDDED

    @property
    def is_http(self) -> bool:
        """Whether the locator must be requested at the daemon's HTTP port."""
        return "://" in self.locator

    def __str__(self) -> str:
        return self.locator if self.name is None else f"{self.locator}#{self.name}"


def is_name(text: str) -> bool:
    """Whether it is a valid name of a daemon or a robot."""
    return re.fullmatch(r"[A-Za-z0-9_-]+", text) is not None


def read_endpoint(text: str | None, name: str | None = None) -> Endpoint:
    """Returns the endpoint of `text`, else of `$SIMD_ENDPOINT`, else `tcp/127.0.0.1:7447`.

    `name` takes precedence over one in the text.
    """
    text = text or os.environ.get(ENVIRONMENT) or DEFAULT_ENDPOINT
    http = None if text.strip() == EMBEDDED else _HTTP.fullmatch(text.strip())
    # `tcp/HOST` is a locator.
    if http is not None and (http["scheme"] or http["rest"] is None):
        return _of_http(text, http, name)
    locator, _, suffix = text.strip().partition("#")
    if locator != EMBEDDED and re.fullmatch(r"[a-z][a-z0-9_]*/[^\s/][^\s]*", locator) is None:
        raise EndpointError(
            f"`{text}` is not an endpoint: those are simd://HOST:PORT/NAME, the address of a daemon's page, a locator of Zenoh "
            f"like {DEFAULT_ENDPOINT}, and `{EMBEDDED}` for a world in this process"
        )
    protocol, _, address = locator.partition("/")
    if protocol in _WITH_PORT and re.search(r":\d+$", address.partition("?")[0]) is None:
        port = DEFAULT_ENDPOINT.rpartition(":")[2]
        raise EndpointError(f"`{text}` has no port: with the default one it is {locator.rstrip(':')}:{port}")
    return Endpoint(locator, _checked(name or suffix or None))


def _of_http(text: str, parts: re.Match[str], name: str | None) -> Endpoint:
    scheme, rest = parts["scheme"], (parts["rest"] or "").removeprefix("/")
    port = int(parts["port"] or _HTTP_PORT)
    if not 1 <= port <= 65535:
        raise EndpointError(f"`{text}` is not an endpoint: its port is not a number from 1 to 65535")
    if scheme in ("http", "https"):
        # The page keeps its view state there.
        rest = "" if rest[:1] in ("?", "#") else rest
        if rest:
            raise EndpointError(f"`{text}` is not an endpoint: the address of a page ends with its port")
    address = f"{'https' if scheme == 'https' else 'http'}://{parts['host']}:{port}"
    return Endpoint(address, _checked(name or rest or None))


def _checked(name: str | None) -> str | None:
    if name is not None and not is_name(name):
        raise EndpointError(f"`{name}` is not the name of a daemon: those have only A-Z, a-z, 0-9, _ and -")
    return name
