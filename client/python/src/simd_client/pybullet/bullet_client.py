"""Replaces `pybullet_utils.bullet_client`: the functions of one connection."""

from __future__ import annotations

import functools
import os
from types import TracebackType
from typing import Any

from simd_client import pybullet

from .connections import connected


class BulletClient:
    """A connection. Its attributes are PyBullet's functions for this connection, which ends with it."""

    # Before the connection opens, and after its end.
    _client = -1

    def __init__(
        self, connection_mode: int | None = None, hostName: str | None = None, options: str = ""
    ) -> None:
        """Connects: see `connect`. `hostName` is for TCP and UDP."""
        mode = pybullet.DIRECT if connection_mode is None else connection_mode
        self._shapes: dict[int, int] = {}
        self._pid = os.getpid()
        self._client = pybullet.connect(mode, hostName=hostName, options=options)
        self._world = connected(self._client)

    def __enter__(self) -> BulletClient:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        problem: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.disconnect()

    def __del__(self) -> None:
        # A forked process does not own the connection.
        if self._client >= 0 and self._pid == os.getpid():
            try:
                self.disconnect()
            except pybullet.error:
                # As in PyBullet: the daemon ended earlier.
                pass

    def disconnect(self) -> None:
        """Ends the connection, if it is open."""
        number, self._client = self._client, -1
        # If the script ended it itself, another connection may have its number.
        if number >= 0 and pybullet.isConnected(number) and connected(number) is self._world:
            pybullet.disconnect(number)

    def __getattr__(self, name: str) -> Any:
        found = getattr(pybullet, name)
        if callable(found) and not isinstance(found, type):
            return functools.partial(found, physicsClientId=self._client)
        return found
