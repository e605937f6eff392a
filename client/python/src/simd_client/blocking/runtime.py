"""How the client waits on the calling thread. `simd_client.aio.runtime` has the same names for asyncio."""

from __future__ import annotations

import threading
from collections.abc import Callable
from time import sleep
from typing import TypeVar

import zenoh

from simd_client.link import AnyMethod, Link

__all__ = ["LatestSample", "in_thread", "query", "sleep"]

Result = TypeVar("Result")


def query(link: Link, method: AnyMethod, payload: bytes, timeout: float) -> bytes:
    """Sends a request and waits for its reply. Returns the reply's bytes."""
    return link.query(method, payload, timeout)


def in_thread(do: Callable[[], Result]) -> Result:
    """Does slow work on this machine's disk."""
    return do()


class LatestSample:
    """Room for one publication: a newer one replaces one that was not taken."""

    def __init__(self) -> None:
        self._payload: bytes | None = None
        self._arrived = threading.Condition()

    def put(self, sample: zenoh.Sample) -> None:
        """Called on a thread of Zenoh's."""
        payload = sample.payload.to_bytes()
        with self._arrived:
            self._payload = payload
            self._arrived.notify()

    def take(self) -> bytes | None:
        """The publication's bytes, if one has arrived."""
        with self._arrived:
            payload, self._payload = self._payload, None
        return payload

    def wait(self, seconds: float) -> bool:
        """Waits for a publication. Returns whether one arrived."""
        with self._arrived:
            return self._arrived.wait_for(lambda: self._payload is not None, seconds)
