"""Joints that one client has for itself."""

from __future__ import annotations

from types import TracebackType

from simd_client.errors import ClaimNotFound, Unavailable
from simd_client.link import Link
from simd_client.memory import Held, Memory
from simd_client.plans import joints


class Claim:
    """Until it is released or lapses, nobody else can give these joints targets.

    While it is held, all calls of the same `Simulation` that set these joints carry it, and each of them renews
    its lease; nothing else does. A client that is killed lets it lapse. Joints that are given back hold their position.
    """

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

    def release(self) -> None:
        """Gives the joints back. Raises `ClaimNotFound` where it lapsed."""
        if self._is_held:
            self._is_held = False
            self._link.run(joints.release(self._memory, self._held), self._timeout)

    def __enter__(self) -> Claim:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self.release()
        except (ClaimNotFound, Unavailable):
            # It lapsed, or the daemon is gone, and the claim with it.
            pass

    def __repr__(self) -> str:
        names = ", ".join(f"{robot}/{joint or '*'}" for robot, joint in sorted(self._held.joints))
        return f"<Claim of {names or 'all joints'}>"
