# Generated from simd_client/aio/claim.py by tools/make_blocking.py; do not edit.
"""A claim on joints: only its holder can set their targets."""

from __future__ import annotations

from types import TracebackType
from typing import TYPE_CHECKING

from simd_client import proto
from simd_client.cache import HeldClaim
from simd_client.errors import ClaimNotFound, Unavailable
from simd_client.proto import methods

if TYPE_CHECKING:
    from simd_client.blocking.connection import Connection


class Claim:
    """Until it is released or lapses, no other client can set targets of these joints. Use it with `with`.

    While it is held, all calls of the same `Simulation` that set these joints carry it, and each of them renews
    its lease; nothing else does. The claim of a client that is killed lapses. Released joints hold their position.
    """

    def __init__(self, connection: Connection, held: HeldClaim) -> None:
        self._connection = connection
        self._held = held
        self._is_held = True

    @property
    def secret(self) -> str:
        """A call that carries it may set the joints."""
        return self._held.secret

    def release(self) -> None:
        """Releases the joints. Raises `ClaimNotFound` if the claim has lapsed."""
        if self._is_held:
            self._is_held = False
            self._connection.cache.drop_claim(self.secret)
            self._connection.call(methods.ReleaseJoints, proto.ReleaseJointsRequest(claim=self.secret))

    def __enter__(self) -> Claim:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self.release()
        except (ClaimNotFound, Unavailable):
            # The claim has lapsed, or it ended with the daemon.
            pass

    def __repr__(self) -> str:
        names = ", ".join(f"{robot}/{joint or '*'}" for robot, joint in sorted(self._held.joints))
        return f"<Claim of {names or 'all joints'}>"
