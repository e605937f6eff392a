# Generated from simd_client/aio/lockstep.py by tools/make_blocking.py; do not edit.
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
    from simd_client.blocking.connection import Connection


@dataclass(frozen=True)
class LockstepMember:
    """One of the clients that step the world together."""

    client: str
    """As it calls itself; empty if it does not."""
    timeout: float
    """The time in seconds that it may take from one step to asking for the next."""
    waits_for: int
    """Steps that it waits for; 0 if the others wait for it."""


class Lockstep(FixedAttributes):
    """A membership among the clients that step the world together. Use it with `with`.

    Until it is left, or its time is over, `Simulation.step` of the same `Simulation` waits for the other members: the
    world advances to the nearest step that a member has asked for, once each of them has asked.
    """

    timeout: float
    """The time in seconds from one step to asking for the next, after which this client is a member no more."""

    def __init__(self, connection: Connection, member: str, timeout: float) -> None:
        self._connection = connection
        self._member = member
        self.timeout = timeout

    def members(self) -> list[LockstepMember]:
        """Who steps the world together, in the order in which they joined."""
        answer = self._connection.call(methods.ListLockstepMembers, proto.ListLockstepMembersRequest())
        return [LockstepMember(each.client, each.timeout, each.waits_for) for each in answer.members]

    def leave(self) -> None:
        """Ends the membership; the others go on. Raises `LockstepMemberNotFound` if it has ended already."""
        if self._connection.cache.lockstep_member == self._member:
            self._connection.cache.lockstep_member = ""
        self._connection.call(methods.LeaveLockstep, proto.LeaveLockstepRequest(member=self._member))

    def __enter__(self) -> Lockstep:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self.leave()
        except (LockstepMemberNotFound, Unavailable):
            # It did not ask in its time, or the daemon has ended.
            pass

    def __repr__(self) -> str:
        return f"<Lockstep, {self.timeout:g} s from step to step>"
