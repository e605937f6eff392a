"""Finds a daemon and connects to it, for asyncio."""

from __future__ import annotations

import asyncio
from collections.abc import Generator
from types import TracebackType
from typing import Any

from simd_client.aio.simulation import Simulation
from simd_client.connect import CONNECT_TIMEOUT, TIMEOUT
from simd_client.endpoint import Endpoint, read_endpoint
from simd_client.link import ZenohConfig, open_link
from simd_client.plans import simulation as plans


class Connecting:
    """A connection that is being made: `async with` it, or `await` it and `close` what comes of it."""

    def __init__(
        self, endpoint: Endpoint, timeout: float, connect_timeout: float, config: ZenohConfig | None
    ) -> None:
        self._endpoint = endpoint
        self._timeout = timeout
        self._connect_timeout = connect_timeout
        self._config = config
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
        # Opening a session is the one thing of Zenoh's that blocks.
        link = await asyncio.to_thread(open_link, self._endpoint, self._connect_timeout, self._config)
        simulation = Simulation(link, self._timeout)
        try:
            await simulation.run(plans.state())
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
) -> Connecting:
    """See `simd_client.connect`."""
    return Connecting(read_endpoint(endpoint, name), timeout, connect_timeout, config)
