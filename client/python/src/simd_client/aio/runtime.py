"""Waits with asyncio. `simd_client.blocking.runtime` has the same names and blocks."""

from __future__ import annotations

import asyncio
import threading
from collections import deque
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from inspect import isawaitable
from typing import TypeVar

from simd_client.errors import DeadlineExceeded, Unavailable
from simd_client.link import MAX_REPLIES, Answer, AnyMethod, Link

LONGEST = 3_600.0
"""Maximum time, in seconds, of a call that ends with the daemon's silence: the longest stream of a daemon."""

Item = TypeVar("Item")
Result = TypeVar("Result")


async def query(link: Link, method: AnyMethod, payload: bytes, timeout: float) -> bytes:
    """Sends a request and waits for its reply. Returns the reply's bytes."""
    loop = asyncio.get_running_loop()
    settled: asyncio.Future[Answer | None] = loop.create_future()

    def settle(reply: Answer | None) -> None:
        if not settled.done():
            settled.set_result(reply)

    def arrived(reply: Answer) -> None:
        _soon(loop, lambda: settle(reply))

    def ended() -> None:
        _soon(loop, lambda: settle(None))

    link.start(method, payload, timeout, arrived, ended)
    reply = await settled
    if reply is None:
        raise link.unavailable()
    return link.opened(reply, timeout)


async def queries(
    link: Link, requests: Sequence[tuple[AnyMethod, bytes]], timeout: float
) -> list[bytes | BaseException]:
    """Sends several requests at once and waits for all replies: the bytes of each, or its error."""
    waiting = (query(link, method, payload, timeout) for method, payload in requests)
    return await asyncio.gather(*waiting, return_exceptions=True)


async def query_until_silent(
    link: Link, method: AnyMethod, payload: bytes, silent: float, alive: tuple[AnyMethod, bytes]
) -> bytes:
    """Like `query`, and waits for as long as the daemon answers `alive`, which it is asked each time that
    `silent` seconds end without the reply."""
    found = b""
    async for found in replies(link, method, payload, LONGEST, silent, alive, is_stream=False):
        break
    return found


async def replies(
    link: Link,
    method: AnyMethod,
    payload: bytes,
    seconds: float,
    silent: float | None = None,
    alive: tuple[AnyMethod, bytes] | None = None,
    *,
    is_stream: bool = True,
) -> AsyncIterator[bytes]:
    """Sends the request of a stream and waits for each of its replies. If more than 256 wait for the reader,
    the newest are kept. Raises `DeadlineExceeded` if no reply arrives for `silent` seconds, and `alive`, if
    it is given, has no answer either."""
    loop = asyncio.get_running_loop()
    waiting: deque[Answer | None] = deque(maxlen=MAX_REPLIES)
    has_some = asyncio.Event()

    def keep(reply: Answer | None) -> None:
        waiting.append(reply)
        has_some.set()

    def arrived(reply: Answer) -> None:
        _soon(loop, lambda: keep(reply))

    link.start(method, payload, seconds, arrived, lambda: _soon(loop, lambda: keep(None)), is_stream=is_stream)
    while True:
        try:
            await asyncio.wait_for(has_some.wait(), silent)
        except asyncio.TimeoutError:
            is_alive = alive is not None and silent is not None and await _answers(link, alive, silent)
            if is_alive or waiting:
                continue
            raise DeadlineExceeded(f"the daemon `{link.name}` said nothing for {silent:g} s") from None
        reply = waiting.popleft()
        if not waiting:
            has_some.clear()
        if reply is None:
            raise link.unavailable()
        yield link.opened(reply, seconds)


async def _answers(link: Link, asked: tuple[AnyMethod, bytes], seconds: float) -> bool:
    """Returns whether the daemon answers a question within `seconds` seconds."""
    method, payload = asked
    try:
        await query(link, method, payload, seconds)
    except (DeadlineExceeded, Unavailable):
        return False
    return True


async def in_thread(do: Callable[[], Result]) -> Result:
    """Does slow disk work of this machine without blocking the event loop."""
    return await asyncio.to_thread(do)


async def sleep(seconds: float) -> None:
    """Waits for `seconds` seconds."""
    await asyncio.sleep(seconds)


class LatestSample:
    """Slot for one publication: a newer one replaces one that was not taken."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._lock = threading.Lock()
        self._payload: bytes | None = None
        self._arrived = asyncio.Event()

    def put(self, key: str, payload: bytes) -> None:
        """Stores a publication; called on a thread of the link. Wakes the loop once, however many arrive
        before it looks."""
        with self._lock:
            was_empty = self._payload is None
            self._payload = payload
        if was_empty:
            _soon(self._loop, self._arrived.set)

    def take(self) -> bytes | None:
        """Returns the publication's bytes, if one has arrived."""
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

    def close(self) -> None:
        """Ends the slot: nothing more arrives."""
        self._arrived.set()


_tasks: set[asyncio.Task[None]] = set()


class Background:
    """Work in the background: a task of the loop."""

    def __init__(self, link: Link, work: Callable[[], Awaitable[None]], end: Callable[[], None]) -> None:
        """Does nothing: the task is cancelled, and `end` is for threads."""
        self.is_stopped = False
        self._work = work
        self._loop = asyncio.get_running_loop()
        self._task = self._loop.create_task(self._run())

    def start(self) -> None:
        """Begins it: the loop itself only has a weak reference to a task."""
        _tasks.add(self._task)
        self._task.add_done_callback(_tasks.discard)

    @property
    def is_done(self) -> bool:
        """Whether it has ended, or was asked to end."""
        return self.is_stopped or self._task.done()

    async def call(self, function: Callable[[Item], object], item: Item) -> None:
        """Calls a function of the caller as a part of this work."""
        result = function(item)
        if isawaitable(result):
            await result

    def stop(self) -> None:
        """Ends the work. The work may call this on itself."""
        self.is_stopped = True
        if asyncio.current_task() is not self._task:
            self._task.cancel()

    async def wait(self, timeout: float | None) -> bool:
        """Waits until it has ended. Returns whether it ended within `timeout` seconds."""
        done, _ = await asyncio.wait([self._task], timeout=timeout)
        return bool(done)

    async def _run(self) -> None:
        try:
            await self._work()
        except Exception as error:
            what = {"message": "a callback of simd_client ended", "exception": error, "task": self._task}
            self._loop.call_exception_handler(what)


def _soon(loop: asyncio.AbstractEventLoop, do: Callable[[], None]) -> None:
    """Calls a function on the loop, from a thread of the link; does nothing if the loop is closed."""
    try:
        loop.call_soon_threadsafe(do)
    except RuntimeError:
        pass
