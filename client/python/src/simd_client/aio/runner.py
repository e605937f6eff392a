"""How a plan is done on an event loop: no thread waits for an answer."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar, cast

import zenoh

from simd_client.errors import SimdError
from simd_client.link import Link
from simd_client.plan import Ask, Plan, Work

Result = TypeVar("Result")

Answer = Coroutine[Any, Any, Result]
"""What a call gives: await it."""


async def run(link: Link, plan: Plan[Result], timeout: float) -> Result:
    """Does what a plan says."""
    try:
        need = next(plan)
        while True:
            try:
                # Only files are read on another thread.
                answer = await (
                    asyncio.to_thread(need.do) if isinstance(need, Work) else query(link, need, timeout)
                )
            except SimdError as error:
                need = plan.throw(error)
            else:
                need = plan.send(answer)
    except StopIteration as end:
        return cast(Result, end.value)


async def query(link: Link, request: Ask, timeout: float) -> bytes:
    """Sends a request and waits for its reply's bytes."""
    loop = asyncio.get_running_loop()
    settled: asyncio.Future[zenoh.Reply | None] = loop.create_future()

    def settle(reply: zenoh.Reply | None) -> None:
        if not settled.done():
            settled.set_result(reply)

    def arrived(reply: zenoh.Reply) -> None:
        soon(loop, lambda: settle(reply))

    def ended() -> None:
        soon(loop, lambda: settle(None))

    link.start(request, timeout, arrived, ended)
    reply = await settled
    if reply is None:
        raise link.nobody()
    return link.opened(reply, timeout + request.wait)


def soon(loop: asyncio.AbstractEventLoop, do: Callable[[], None]) -> None:
    """Does something on the loop, from a thread of Zenoh's; nothing once the loop is closed."""
    try:
        loop.call_soon_threadsafe(do)
    except RuntimeError:
        pass
