"""What a client remembers of a world between calls: layouts that it fetched, claims that it holds."""

from __future__ import annotations

import threading
from collections.abc import Iterable
from dataclasses import dataclass

from simd_client.layout import Layout


@dataclass(frozen=True)
class Held:
    """Joints that this client has claimed."""

    secret: str
    """Whoever has it may set the joints."""
    joints: frozenset[tuple[str, str]]
    """`(robot, joint)` each; an empty joint is all of the robot's."""


class Memory:
    """May be used from several threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._layouts: dict[str, Layout] = {}
        self._stale: set[str] = set()
        self._claims: list[Held] = []

    def layout(self, robot: str) -> Layout | None:
        """The newest that was fetched, be it of a robot that was reloaded meanwhile."""
        return self._layouts.get(robot)

    def fresh_layout(self, robot: str) -> Layout | None:
        """The same, unless something was heard of a newer one."""
        return None if robot in self._stale else self._layouts.get(robot)

    def keep_layout(self, layout: Layout) -> None:
        """Remembers what was fetched."""
        with self._lock:
            self._layouts[layout.robot] = layout
            self._stale.discard(layout.robot)

    def doubt_layout(self, robot: str) -> None:
        """The robot has another layout now, or other limits: it is to be fetched again."""
        with self._lock:
            self._stale.add(robot)

    def keep_claim(self, held: Held) -> None:
        """From now on, calls for these joints carry the claim."""
        with self._lock:
            self._claims = [*self._claims, held]

    def drop_claim(self, secret: str) -> None:
        """From now on, no call carries it."""
        with self._lock:
            self._claims = [held for held in self._claims if held.secret != secret]

    def claim_for(self, joints: Iterable[tuple[str, str]]) -> str:
        """The claim that a call for these joints must carry; empty for none. Raises `ValueError` where it
        would be two, since a call carries one."""
        if not self._claims:
            return ""
        wanted = list(joints)
        secrets = {held.secret for held in self._claims for joint in wanted if _covers(held, joint)}
        if len(secrets) > 1:
            raise ValueError("one call sets joints of two claims; claim them together, or make two calls")
        return secrets.pop() if secrets else ""


def _covers(held: Held, wanted: tuple[str, str]) -> bool:
    robot, joint = wanted
    if joint == "":
        return any(owner == robot for owner, _ in held.joints)
    return (robot, joint) in held.joints or (robot, "") in held.joints
