"""Listeners that run after each step of a world."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from .world import World


class Log(Protocol):
    """A listener that runs after each step."""

    def __call__(self, world: World) -> None:
        """Called after a step."""
        ...

    def close(self) -> None:
        """Called after the last step."""
        ...
