"""A claim on robots, joints or the world: only its holder can change them."""

from __future__ import annotations

from types import TracebackType
from typing import TYPE_CHECKING

from simd_client import proto
from simd_client.attributes import FixedAttributes
from simd_client.cache import HeldClaim
from simd_client.errors import ClaimNotFound, Unavailable
from simd_client.proto import methods

if TYPE_CHECKING:
    from simd_client.aio.connection import Connection


class Claim(FixedAttributes):
    """While it is held, no other client can change the claimed robots, joints or world: targets, resets,
    properties, poses, wrenches, reloads, deletes. Use it with `async with`.

    While it is held, all calls of the same `Simulation` that change claimed things carry it. Each of them
    renews its lease; other calls do not. The claim of a killed client lapses. Released joints hold their
    position.
    """

    def __init__(self, connection: Connection, held: HeldClaim) -> None:
        self._connection = connection
        self._held = held
        self._is_held = True

    @property
    def secret(self) -> str:
        """Secret of the claim; a call that carries it acts for the claim."""
        return self._held.secret

    async def release(self) -> None:
        """Releases the claim. Raises `ClaimNotFound` if the claim has lapsed or was taken over."""
        if self._is_held:
            self._is_held = False
            self._connection.cache.drop_claim(self.secret)
            await self._connection.call(methods.ReleaseJoints, proto.ReleaseJointsRequest(claim=self.secret))

    async def __aenter__(self) -> Claim:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            await self.release()
        except (ClaimNotFound, Unavailable):
            # The claim has lapsed, was taken over, or ended with the daemon.
            pass

    def __repr__(self) -> str:
        names = ", ".join(f"{robot}/{joint or '*'}" for robot, joint in sorted(self._held.joints))
        return f"<Claim of {', '.join(filter(None, [names, 'the world' if self._held.world else '']))}>"
