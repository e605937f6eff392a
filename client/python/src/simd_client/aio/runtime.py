"""How the client waits with asyncio. `simd_client.blocking.runtime` has the same names and blocks."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from typing import TypeVar

import zenoh

from simd_client.link import AnyMethod, Link

Result = TypeVar("Result")


async def query(link: Link, method: AnyMethod, payload: bytes, timeout: float) -> bytes:
    """Sends a request and waits for its reply. Returns the reply's bytes."""
    loop = asyncio.get_running_loop()
    settled: asyncio.Future[zenoh.Reply | None] = loop.create_future()

    def settle(reply: zenoh.Reply | None) -> None:
        if not settled.done():
            settled.set_result(reply)

    def arrived(reply: zenoh.Reply) -> None:
        _soon(loop, lambda: settle(reply))

    def ended() -> None:
        _soon(loop, lambda: settle(None))

    link.start(method, payload, timeout, arrived, ended)
    reply = await settled
    if reply is None:
        raise link.unavailable()
    return link.opened(reply, timeout)


async def in_thread(do: Callable[[], Result]) -> Result:
    """Does slow work on this machine's disk without blocking the event loop."""
    return await asyncio.to_thread(do)


async def sleep(seconds: float) -> None:
    """Waits for so many seconds."""
    await asyncio.sleep(seconds)


class LatestSample:
    """Room for one publication: a newer one replaces one that was not taken."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._lock = threading.Lock()
        self._payload: bytes | None = None
        self._arrived = asyncio.Event()

    def put(self, sample: zenoh.Sample) -> None:
        """Called on a thread of Zenoh's. Wakes the loop once, however many arrive before it looks."""
        payload = sample.payload.to_bytes()
        with self._lock:
            was_empty = self._payload is None
            self._payload = payload
        if was_empty:
            _soon(self._loop, self._arrived.set)

    def take(self) -> bytes | None:
        """The publication's bytes, if one has arrived."""
        self._arrived.clear()
        with self._lock:
            payload, self._payload = self._payload, None
        return payload

    async def wait(self, seconds: float) -> bool:
        """Waits for a publication. Returns whether one arrived."""
        try:
            await asyncio.wait_for(self._arrived.wait(), seconds)
        except asyncio.TimeoutError:
            return False
        return True


def _soon(loop: asyncio.AbstractEventLoop, do: Callable[[], None]) -> None:
    """Does something on the loop, from a thread of Zenoh's; nothing if the loop is closed."""
    try:
        loop.call_soon_threadsafe(do)
    except RuntimeError:
        pass
