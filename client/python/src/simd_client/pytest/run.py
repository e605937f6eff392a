"""A test that uses a world: it is recorded, and its files are kept if it fails."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

import pytest

from simd_client.blocking.recording import Recording
from simd_client.blocking.watch import next_events
from simd_client.errors import SimdError
from simd_client.event import Event
from simd_client.layout import Layout
from simd_client.plots import plotted

from .recorded_states import ENDING, last_states
from .results import Results
from .worlds import World

MAX_BYTES = 1 << 30
"""Maximum size of a recording; it ends there."""
PLOT_SECONDS = 5.0
"""Simulated seconds before the failure that are plotted."""
PLOTS = 8
"""Maximum number of robots that are plotted."""
EVENTS = 10_000
"""Maximum number of events in the log."""

_LONGEST = 64


class Run:
    """One test, from the moment at which it has its world."""

    def __init__(
        self, results: Results, world: World, test: pytest.Item, *, is_recorded: bool, keeps_all: bool
    ) -> None:
        self._results = results
        self._world = world
        self._test = test
        self._keeps_all = keeps_all
        # Whether it has passed or was skipped. It has not if it was interrupted.
        self._is_done = False
        self._is_kept = False
        sim = world.sim
        self._first_event = next_events(sim, 0, 0.0)[1]
        self._recording: Recording | None = None
        if is_recorded:
            name = re.sub(r"[^A-Za-z0-9_-]+", "-", test.nodeid).strip("-")[-_LONGEST:]
            self._recording = sim.record(name, max_bytes=MAX_BYTES)

    def judge(self, report: pytest.TestReport) -> None:
        """Takes the report of the test's setup or call, and keeps the files if it failed. The report says
        where."""
        if report.when == "teardown":
            return
        self._is_done = report.skipped or report.when == "call"
        if report.failed and not self._is_kept:
            self._is_kept = True
            report.sections.append(("simd", self._keep(report)))

    def end(self) -> None:
        """The test has ended; its connection is still there."""
        if self._is_kept:
            return
        if not self._is_done or self._keeps_all:
            self._keep(None)
            return
        self._results.remove(self._test.nodeid)
        recorded = self._stopped([])
        if recorded is not None:
            recorded.unlink(missing_ok=True)

    def _keep(self, report: pytest.TestReport | None) -> str:
        """Keeps the files; returns a text for people. A failure of it never hides the test's."""
        notes: list[str] = []
        try:
            place = self._kept(report, notes)
        except (OSError, SimdError) as error:
            notes.append(f"the files of this test could not be kept: {error}")
        else:
            self._test.user_properties.append(("simd-results", str(place)))
            names = ", ".join(sorted(file.name for file in place.iterdir()))
            notes.insert(0, f"kept in {place}: {names}")
            recording = place / f"recording{ENDING}"
            if recording.exists():
                notes.append(f"run it again: pytest --simd-replay {recording}")
        return "\n".join(notes)

    def _kept(self, report: pytest.TestReport | None, notes: list[str]) -> Path:
        folder = Path(tempfile.mkdtemp(prefix="kept-", dir=self._results.scratch))
        folder.chmod(0o755)
        # Before the recording stops, since the world may have ended with the test.
        layouts, events = self._layouts(notes), self._events(notes)
        recorded = self._stopped(notes)
        if recorded is not None and recorded.exists():
            recording = recorded.rename(folder / f"recording{ENDING}")
            try:
                self._plot(recording, layouts, folder)
            except ImportError as missing:
                notes.append(f"there is no plot: {missing}")
        (folder / "log.txt").write_text(self._text(report, events, notes), encoding="utf-8")
        return self._results.put(self._test.nodeid, folder)

    def _stopped(self, notes: list[str]) -> Path | None:
        """Ends the recording; returns its file."""
        if self._recording is None:
            return None
        try:
            self._recording.stop()
        except SimdError as error:
            notes.append(f"the recording had ended: {error}")
        return self._results.scratch / f"{self._recording.name}{ENDING}"

    def _layouts(self, notes: list[str]) -> dict[str, Layout]:
        try:
            robots = list(self._world.sim.robots.items())[:PLOTS]
            return {name: robot.layout for name, robot in robots if robot.layout.moving}
        except SimdError as error:
            notes.append(f"the world does not answer any more: {error}")
            return {}

    def _events(self, notes: list[str]) -> list[Event]:
        found: list[Event] = []
        try:
            while len(found) < EVENTS:
                after = found[-1].sequence if found else self._first_event
                more, _ = next_events(self._world.sim, after, 0.0)
                if not more:
                    break
                found += more
        except SimdError:
            # The layouts have the same note.
            pass
        return found

    def _plot(self, recording: Path, layouts: dict[str, Layout], folder: Path) -> None:
        for robot, states in last_states(recording, layouts, PLOT_SECONDS).items():
            figure = plotted(states, ("position", "velocity", "effort"), states[0].selected)
            figure.savefig(folder / f"{robot}.png", dpi=100)

    def _text(self, report: pytest.TestReport | None, events: list[Event], notes: list[str]) -> str:
        parts = [("test", self._test.nodeid), ("notes", "\n".join(notes))]
        if report is not None:
            parts += [(f"failed: {report.when}", report.longreprtext), *report.sections]
        parts += [("events", "\n".join(map(repr, events))), ("log of the daemon", self._world.log())]
        return "".join(f"--- {title} ---\n{text.rstrip()}\n\n" for title, text in parts if text)
