"""Connects to a daemon, for asyncio."""

from __future__ import annotations

import asyncio
from collections.abc import Generator
from types import TracebackType
from typing import Any

from simd_client.aio.simulation import Simulation
from simd_client.endpoint import CONNECT_TIMEOUT, TIMEOUT, Endpoint, read_endpoint
from simd_client.open_link import ZenohConfig, open_link


class Connecting:
    """Connects on use: with `async with`, or with `await` and `close`."""

    def __init__(
        self,
        endpoint: Endpoint,
        timeout: float,
        connect_timeout: float,
        config: ZenohConfig | None,
        token: str | None,
        serve: str | None,
    ) -> None:
        self._endpoint = endpoint
        self._timeout = timeout
        self._connect_timeout = connect_timeout
        self._config = config
        self._token = token
        self._serve = serve
        self._made: Simulation | None = None

    def __await__(self) -> Generator[Any, Any, Simulation]:
        return self._connect().__await__()

    async def __aenter__(self) -> Simulation:
        self._made = await self._connect()
        return self._made

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._made is not None:
            await self._made.close()

    async def _connect(self) -> Simulation:
        # Opening a Zenoh session blocks.
        link = await asyncio.to_thread(
            open_link, self._endpoint, self._connect_timeout, self._config, self._token, self._serve
        )
        simulation = Simulation(link, self._timeout)
        try:
            # The daemon refuses any call but `GetSimulatorInfo` if the versions do not match: better now than
            # later.
            await simulation.stamp
        except BaseException:
            await simulation.close()
            raise
        return simulation


def connect(
    endpoint: str | None = None,
    name: str | None = None,
    *,
    timeout: float = TIMEOUT,
    connect_timeout: float = CONNECT_TIMEOUT,
    config: ZenohConfig | None = None,
    token: str | None = None,
    serve: str | None = None,
) -> Connecting:
    """See `simd_client.connect`."""
    return Connecting(read_endpoint(endpoint, name), timeout, connect_timeout, config, token, serve)
