"""Replaces `pybullet_utils.bullet_client`: the functions of one connection."""

from __future__ import annotations

import functools
from types import TracebackType
from typing import Any

from simd_client import pybullet


class BulletClient:
    """A connection; its attributes are PyBullet's, for this connection."""

    def __init__(self, connection_mode: int | None = None, options: str = "") -> None:
        mode = pybullet.DIRECT if connection_mode is None else connection_mode
        self._shapes: dict[int, int] = {}
        self._client = pybullet.connect(mode, options=options)

    def __enter__(self) -> BulletClient:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        problem: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.disconnect()

    def disconnect(self) -> None:
        """Ends the connection, if it is open."""
        if self._client >= 0 and pybullet.getConnectionInfo(self._client)["isConnected"]:
            pybullet.disconnect(self._client)
        self._client = -1

    def __getattr__(self, name: str) -> Any:
        found = getattr(pybullet, name)
        if callable(found) and not isinstance(found, type):
            return functools.partial(found, physicsClientId=self._client)
        return found
