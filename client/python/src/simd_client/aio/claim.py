"""Joints that one client has for itself, for asyncio."""

from __future__ import annotations

from types import TracebackType

from simd_client.aio.runner import run
from simd_client.errors import ClaimNotFound, Unavailable
from simd_client.link import Link
from simd_client.memory import Held, Memory
from simd_client.plans import joints


class Claim:
    """See `simd_client.Claim`; use it with `async with`."""

    def __init__(self, link: Link, memory: Memory, held: Held, timeout: float) -> None:
        self._link = link
        self._memory = memory
        self._held = held
        self._timeout = timeout
        self._is_held = True

    @property
    def secret(self) -> str:
        """Whoever has it may set the joints."""
        return self._held.secret

    async def release(self) -> None:
        """Gives the joints back. Raises `ClaimNotFound` where it lapsed."""
        if self._is_held:
            self._is_held = False
            await run(self._link, joints.release(self._memory, self._held), self._timeout)

    async def __aenter__(self) -> Claim:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            await self.release()
        except (ClaimNotFound, Unavailable):
            # It lapsed, or the daemon is gone, and the claim with it.
            pass
