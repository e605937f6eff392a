"""Limits the rate of an iterator."""

from __future__ import annotations

import time


class Pacer:
    """Schedule of the next item. Deadlines are absolute and do not drift; a missed one is not repeated."""

    def __init__(self, rate: float | None) -> None:
        """Allows at most `rate` items per wall second; `None` does not limit it. Raises `ValueError` unless
        it is above 0."""
        if rate is not None and not rate > 0:
            raise ValueError(f"a rate is above 0, not {rate}")
        self._period = 0.0 if rate is None else 1.0 / rate
        self._due = time.monotonic()

    def left(self) -> float:
        """Returns seconds until the next item is due. The one after it is due a period later."""
        now = time.monotonic()
        left = max(0.0, self._due - now)
        self._due = max(self._due, now) + self._period
        return left
