"""Several clients that step one world together."""

from __future__ import annotations

from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING

from simd_client import proto
from simd_client.attributes import FixedAttributes
from simd_client.errors import LockstepMemberNotFound, Unavailable
from simd_client.proto import methods

if TYPE_CHECKING:
    from simd_client.aio.connection import Connection


@dataclass(frozen=True)
class LockstepMember:
    """One of the clients that step the world together."""

    client: str
    """Name that it gives itself; may be empty."""
    timeout: float
    """Maximum time in seconds from one step to its next request."""
    waits_for: int
    """Steps that it waits for; 0 if the others wait for it."""


class Lockstep(FixedAttributes):
    """A membership among the clients that step the world together. Use it with `async with`.

    While the membership lasts, `Simulation.step` of the same `Simulation` waits for the other members. Once
    each has asked, the world advances to the nearest step that a member requested.
    """

    timeout: float
    """Maximum time in seconds from one step to the next request; a slower client loses its membership."""

    def __init__(self, connection: Connection, member: str, timeout: float) -> None:
        self._connection = connection
        self._member = member
        self.timeout = timeout

    async def members(self) -> list[LockstepMember]:
        """Returns the clients that step the world together, in the order in which they joined."""
        answer = await self._connection.call(methods.ListLockstepMembers, proto.ListLockstepMembersRequest())
        return [LockstepMember(each.client, each.timeout, each.waits_for) for each in answer.members]

    async def leave(self) -> None:
        """Ends the membership; the other members continue. Raises `LockstepMemberNotFound` if it has ended
        already."""
        if self._connection.cache.lockstep_member == self._member:
            self._connection.cache.lockstep_member = ""
        await self._connection.call(methods.LeaveLockstep, proto.LeaveLockstepRequest(member=self._member))

    async def __aenter__(self) -> Lockstep:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            await self.leave()
        except (LockstepMemberNotFound, Unavailable):
            # It did not ask in time, or the daemon has ended.
            pass

    def __repr__(self) -> str:
        return f"<Lockstep, {self.timeout:g} s from step to step>"
