"""Client-side copies of a world between calls: fetched layouts and held claims."""

from __future__ import annotations

import threading
from collections.abc import Generator, Iterable
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from simd_client.errors import LayoutChanged
from simd_client.layout import Layout


@dataclass(frozen=True)
class HeldClaim:
    """A claim that this client holds."""

    secret: str
    """Secret of the claim; a call that carries it acts for the claim."""
    joints: frozenset[tuple[str, str]]
    """`(robot, joint)` each; an empty joint means the whole robot."""
    world: bool = False
    """Whether it covers changes that affect all robots."""


class Cache:
    """May be used from several threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._layouts: dict[str, Layout] = {}
        self._stale: set[str] = set()
        self._claims: list[HeldClaim] = []
        self.lockstep_member = ""
        """Membership that each step carries; empty if this client steps alone."""

    def layout(self, robot: str) -> Layout | None:
        """Returns the last fetched layout, even if the robot was reloaded since."""
        return self._layouts.get(robot)

    def fresh_layout(self, robot: str) -> Layout | None:
        """Returns the last fetched layout, unless it is marked stale."""
        return None if robot in self._stale else self._layouts.get(robot)

    def keep_layout(self, layout: Layout) -> None:
        """Stores a fetched layout."""
        with self._lock:
            self._layouts[layout.robot] = layout
            self._stale.discard(layout.robot)

    def mark_stale(self, robot: str) -> None:
        """Marks the layout stale: the robot's layout or limits have changed."""
        with self._lock:
            self._stale.add(robot)

    @contextmanager
    def marking_stale(self) -> Generator[None, None, None]:
        """Marks a layout stale if the daemon refuses a call because it has changed."""
        try:
            yield
        except LayoutChanged as error:
            if "robot" in error.metadata:
                self.mark_stale(error.metadata["robot"])
            raise

    def keep_claim(self, held: HeldClaim) -> None:
        """Makes calls for claimed things carry the claim from now on."""
        with self._lock:
            self._claims = [*self._claims, held]

    def drop_claim(self, secret: str) -> None:
        """Makes calls stop carrying the claim from now on."""
        with self._lock:
            self._claims = [held for held in self._claims if held.secret != secret]

    def claim_for(self, joints: Iterable[tuple[str, str]]) -> str:
        """Returns the claim that a call for these joints must carry; empty for none. Raises `ValueError` if
        it would need two, because a call carries one."""
        if not self._claims:
            return ""
        wanted = list(joints)
        secrets = {held.secret for held in self._claims for joint in wanted if _covers(held, joint)}
        if len(secrets) > 1:
            raise ValueError("one call sets joints of two claims; claim them together, or make two calls")
        return secrets.pop() if secrets else ""

    def carry_claim(self, request: Any) -> None:
        """Adds a claim to a changing request, if its message has the field and names none."""
        # The common case comes first: reading a message's fields costs part of a round trip in the same
        # process.
        if not self._claims:
            return
        fields = request.DESCRIPTOR.fields_by_name
        if "claim" not in fields or request.claim:
            return
        named = [request.robot] if "robot" in fields else [each.robot for each in getattr(request, "robots", ())]
        request.claim = self.claim_for_robots(named)

    def claim_for_robots(self, robots: Iterable[str]) -> str:
        """Returns the claim that a call for these robots carries, or, without robots, a call for the world;
        empty for none. The call carries one: if it would need two, the daemon refuses it."""
        named = set(robots)
        for held in self._claims:
            if named & {robot for robot, _ in held.joints}:
                return held.secret
        if named or not self._claims:
            return ""
        # Without a claim on the world, the client's own claim is enough if no other client holds any.
        return next((held.secret for held in self._claims if held.world), self._claims[0].secret)


def _covers(held: HeldClaim, wanted: tuple[str, str]) -> bool:
    robot, joint = wanted
    if joint == "":
        return any(owner == robot for owner, _ in held.joints)
    return (robot, joint) in held.joints or (robot, "") in held.joints
