"""Progress bars, by tqdm's protocol: tqdm's own, or this module's bar in a terminal or in a notebook."""

from __future__ import annotations

import html
import shutil
import sys
import time
from collections.abc import Callable
from typing import Any, Protocol, TextIO, Union

from simd_client.table import printable

PERIOD = 0.1
"""Seconds between two drawings of a bar."""
WIDTH = 30
"""Characters of a bar in a terminal."""


class Bar(Protocol):
    """The used part of a `tqdm`."""

    def update(self, n: int, /) -> object:
        """Adds finished work."""
        ...

    def close(self) -> object:
        """Closes the bar."""
        ...


Progress = Union[bool, Callable[..., Bar]]
"""`True` for this module's bar, or a factory of bars: `tqdm.auto.tqdm`, or any callable that takes `total`,
`desc`, `unit` and `unit_scale` by name."""


class Bars:
    """Shows progress, one bar after the other."""

    def __init__(self, progress: Progress) -> None:
        self._make: Callable[..., Bar] | None = OwnBar if progress is True else progress or None
        self._bar: Bar | None = None
        self._done = 0
        self._what = ("", 0)

    def begin(self, description: str, total: int, unit: str) -> None:
        """Begins the next bar."""
        self.end()
        if self._make is not None and total > 0:
            self._bar = self._make(total=total, desc=description, unit=unit, unit_scale=unit == "B")
        self._done, self._what = 0, (description, total)

    def reach(self, description: str, done: int, total: int, unit: str) -> None:
        """Sets the finished work of a bar, which may be new."""
        if (description, total) != self._what:
            self.begin(description, total, unit)
        self.add(done - self._done)

    def add(self, count: int) -> None:
        """Adds finished work."""
        if count > 0:
            self._done += count
            if self._bar is not None:
                self._bar.update(count)

    def end(self) -> None:
        """Closes the bar."""
        if self._bar is not None:
            self._bar.close()
        self._bar = None

    def __enter__(self) -> Bars:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()


class OwnBar:
    """Returns a bar of text if stderr is a terminal, a bar of HTML in a notebook, else none."""

    def __init__(self, *, total: int, desc: str, unit: str, unit_scale: bool) -> None:
        self._total, self._unit, self._scaled = total, unit, unit_scale
        self._description = printable(desc)
        self._done = 0
        self._drawn = -PERIOD
        self._draw = _notebook() or _terminal(sys.stderr)
        self._show()

    def update(self, n: int, /) -> None:
        """Adds finished work."""
        self._done += n
        if self._done >= self._total or time.monotonic() - self._drawn >= PERIOD:
            self._show()

    def close(self) -> None:
        """Leaves the bar as it is."""
        self._show(is_last=True)

    def _show(self, is_last: bool = False) -> None:
        self._drawn = time.monotonic()
        if self._draw is not None:
            part = min(1.0, self._done / self._total)
            amount = f"{self._number(self._done)}/{self._number(self._total)} {self._unit}"
            self._draw(self._description, part, amount, is_last)

    def _number(self, count: int) -> str:
        if not self._scaled:
            return str(count)
        value, factors = float(count), iter(("", "k", "M", "G"))
        factor = next(factors)
        while value >= 999.5 and (larger := next(factors, "")):
            value, factor = value / 1000.0, larger
        return f"{value:.3g}{factor}"


Draw = Callable[[str, float, str, bool], None]


def _terminal(stream: TextIO | None) -> Draw | None:
    if stream is None or not stream.isatty():
        return None

    def draw(description: str, part: float, amount: str, is_last: bool) -> None:
        filled = "#" * round(part * WIDTH)
        line = f"{description}: {part:4.0%} |{filled:<{WIDTH}}| {amount}"
        # The rest of a longer line is cleared; a line that wraps could not be drawn again.
        stream.write("\r\x1b[K" + line[: shutil.get_terminal_size().columns - 1] + ("\n" if is_last else ""))
        stream.flush()

    return draw


def _notebook() -> Draw | None:
    """Returns a function that draws in a notebook; `None` outside of one. A notebook's kernel has IPython
    loaded, and its display can be updated."""
    shell: Any = sys.modules.get("IPython")
    shell = shell.get_ipython() if shell is not None else None
    if shell is None or not hasattr(shell, "kernel"):
        return None
    display: Any = sys.modules["IPython.display"]
    handle: Any = None

    def draw(description: str, part: float, amount: str, is_last: bool) -> None:
        nonlocal handle
        shown = display.HTML(
            f"{html.escape(description)} <progress value={part:.3f} max=1></progress> {html.escape(amount)}"
        )
        if handle is None:
            handle = display.display(shown, display_id=True)
        else:
            handle.update(shown)

    return draw
