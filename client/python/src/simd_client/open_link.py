"""Opens a link to a daemon: a Zenoh session, for which it chooses the daemon, or a world in this process."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Mapping
from pathlib import Path
from typing import cast

import zenoh

from simd_client import tls, ways
from simd_client.daemons import Daemons, several
from simd_client.embedded_link import open_embedded
from simd_client.endpoint import DEFAULT_NAME, Endpoint
from simd_client.errors import EndpointError, SimdError, Unavailable
from simd_client.link import Link
from simd_client.proto import methods
from simd_client.zenoh_link import MAX_ANSWER_BYTES, ZenohLink

LEASE_MS = 5000
"""Milliseconds of silence after which daemon and client consider each other gone."""
REACHED_SECONDS = 1.0
"""Seconds to reach an announced daemon."""

ZenohConfig = str | os.PathLike[str] | Mapping[str, object]
"""Additional settings for Zenoh: a JSON5 file, or values by dotted or slashed names. A world in this process
takes its configuration: the file of a daemon (TOML) or values by dotted names."""


class _Zenoh:
    """Zenoh's process-wide threads, which a fork does not copy. A session opened afterwards waits for them
    forever."""

    def __init__(self) -> None:
        self.is_used = self.is_of_a_parent = False

    def forked(self) -> None:
        """Called in a forked process."""
        self.is_of_a_parent = self.is_of_a_parent or self.is_used


_zenoh = _Zenoh()
os.register_at_fork(after_in_child=_zenoh.forked)


def open_link(
    endpoint: Endpoint,
    connect_timeout: float,
    config: ZenohConfig | None = None,
    token: str | None = None,
    serve: str | None = None,
) -> Link:
    """Opens a session and chooses the daemon, or opens a world, which is served at `serve`."""
    if endpoint.is_embedded:
        return open_embedded(endpoint, config, serve)
    if serve is not None:
        raise EndpointError(
            f"serve={serve!r} is for a world in this process: connect to `embedded`; a daemon at {endpoint} serves where its setting `listen` says"
        )
    if endpoint.is_http:
        endpoint = ways.find(endpoint, connect_timeout, tls.known_authority(config))
    settings = _settings(endpoint, connect_timeout, config)
    tls.check_files(endpoint, settings)
    if _zenoh.is_of_a_parent:
        raise Unavailable(
            f"{endpoint} cannot be reached: this process was forked from one that had a connection over Zenoh, whose threads are "
            "only there; start processes with the method `spawn`, or open a world in this process (`embedded`)"
        )
    _zenoh.is_used = True
    try:
        session = zenoh.open(settings)
    except zenoh.ZError as error:
        raise Unavailable(
            tls.why_not(endpoint, settings)
            or f"no daemon answers at {endpoint.locator}; start one with `simd`, or name the endpoint of another"
        ) from error
    try:
        daemons = Daemons()
        # Before `follow`: Zenoh does not answer a question with tokens that it is sending to a subscriber.
        daemons.look(session, connect_timeout)
        name = _choose(endpoint, daemons.names())
        sessions = daemons.sessions(name)
        if len(sessions) > 1:
            raise EndpointError(several(name, sessions))
        daemons.follow(session, name)
    except BaseException:
        session.close()  # pyright: ignore[reportUnknownMemberType]
        raise
    link = ZenohLink(session, endpoint, name, daemons, token)
    _wait_until_reached(link, min(connect_timeout, REACHED_SECONDS))
    return link


def _wait_until_reached(link: Link, timeout: float) -> None:
    """Waits until calls reach the daemon. Its token may be known before its queryables, and a call without a
    queryable ends at once. The first call of the program reports why no answer arrives."""
    give_up = time.monotonic() + timeout
    while time.monotonic() < give_up:
        try:
            link.query(methods.GetSimulatorInfo, b"", timeout)
        except Unavailable:
            time.sleep(0.01)
        except SimdError:
            return
        else:
            return


def _choose(endpoint: Endpoint, there: list[str]) -> str:
    where = endpoint.locator
    names = ", ".join(f"`{name}`" for name in there)
    if endpoint.name is not None:
        if endpoint.name in there:
            return endpoint.name
        others = f"; there are {names}" if there else ""
        raise Unavailable(f"no daemon named `{endpoint.name}` answers at {where}{others}")
    if len(there) == 1:
        return there[0]
    if DEFAULT_NAME in there:
        return DEFAULT_NAME
    if not there:
        raise Unavailable(
            f"no daemon answers at {where}; start one with `simd`, or name the endpoint of another"
        )
    raise EndpointError(
        f"several daemons answer at {where}: choose one of {names}, as {where}#{there[0]}"
    )


def _settings(endpoint: Endpoint, connect_timeout: float, config: ZenohConfig | None) -> zenoh.Config:
    if isinstance(config, (str, os.PathLike)):
        settings = cast(zenoh.Config, zenoh.Config.from_file(Path(config)))  # pyright: ignore[reportUnknownMemberType]
        extra: Mapping[str, object] = {}
    else:
        settings = zenoh.Config()
        extra = config or {}
    ours: dict[str, object] = {
        "mode": "client",
        "connect/endpoints": [endpoint.locator],
        "connect/timeout_ms": max(1, round(connect_timeout * 1000)),
        "connect/exit_on_failure": True,
    }
    if not isinstance(config, (str, os.PathLike)):
        # A file has all settings, except where to connect.
        ours |= {
            "scouting/multicast/enabled": False,
            "scouting/gossip/enabled": False,
            "transport/link/tx/lease": LEASE_MS,
            "transport/link/rx/max_message_size": MAX_ANSWER_BYTES,
            "transport/shared_memory/enabled": False,
        }
    theirs = {name.replace(".", "/"): value for name, value in extra.items()}
    for name, value in {**tls.of_environment(endpoint, theirs), **ours, **theirs}.items():
        try:
            settings.insert_json5(name, json.dumps(value))  # pyright: ignore[reportUnknownMemberType]
        except zenoh.ZError as error:
            raise EndpointError(f"Zenoh does not take `{name}` = {value!r}: {error}") from error
    return settings
