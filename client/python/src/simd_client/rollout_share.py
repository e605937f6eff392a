"""A rollout that several daemons share: which copies are still to be asked for, and one answer of all parts."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from simd_client import proto
from simd_client.errors import AnswerError, DeadlineExceeded, SimdError, Unavailable
from simd_client.rollout import Control, Cost, Observation, Start, Variation, rollout_to_proto
from simd_client.rollout_answer import MOST_BYTES, Rollout
from simd_client.rollout_draws import drawn

TOGETHER = 8
"""Copies that a processor steps at one time, at the most: parts have a multiple of them."""

PARTS_EACH = 4
"""Parts for each daemon: more take more round trips, with fewer a slow daemon keeps the others waiting longer."""

SILENT_SECONDS = 10.0
"""A daemon says four times a second how far its part is: one that says nothing for so long hangs."""

LEAST_SILENT_SECONDS = 1.0
"""It is given so long also where there is little time left."""

MOST_ENDED = 16
"""Copies that ended early whose reasons an answer has, as the daemon's."""


@dataclass(frozen=True, eq=False)
class Asked:
    """A rollout as a program asks for it."""

    steps: int
    copies: int | None
    controls: Sequence[Control]
    starts: Sequence[Start]
    variations: Sequence[Variation]
    observe: Sequence[Observation]
    costs: Sequence[Cost]
    saved_state: str
    record_steps: int
    record_start: bool
    step_costs: bool
    seed: int

    def request(self) -> proto.RolloutRequest:
        """As a message. Raises `ValueError` as `rollout_to_proto` does."""
        return rollout_to_proto(
            self.steps,
            self.copies,
            self.controls,
            self.starts,
            self.variations,
            self.observe,
            self.costs,
            saved_state=self.saved_state,
            record_steps=self.record_steps,
            record_start=self.record_start,
            step_costs=self.step_costs,
            seed=self.seed,
        )

    def part(self, copies: range, widths: Sequence[int]) -> Asked:
        """The same for these copies alone, with the same numbers. `widths` is how many numbers a copy has of each variation
        that is drawn."""
        variations = [
            replace(each, values=_rows(each.values, 2, copies))
            # A daemon counts copies from 0: it draws for the first ones itself, and refuses in its own words.
            if copies.start == 0 or each.values is not None
            else drawn(each, index, self.seed, copies, width)
            for index, (each, width) in enumerate(zip(self.variations, widths, strict=True))
        ]
        return replace(
            self,
            copies=len(copies),
            controls=[_control(each, copies) for each in self.controls],
            starts=[_start(each, copies) for each in self.starts],
            variations=variations,
        )


def _control(control: Control, copies: range) -> Control:
    feedback = control.feedback
    if feedback is not None:
        gains = feedback.gains if np.ndim(feedback.gains) != 4 else np.asarray(feedback.gains)[_slice(copies)]
        feedback = replace(feedback, gains=gains, references=_rows(feedback.references, 3, copies))
    return replace(control, values=_rows(control.values, 3, copies), feedback=feedback)


def _start(start: Start, copies: range) -> Start:
    return replace(
        start,
        positions=_rows(start.positions, 2, copies),
        velocities=_rows(start.velocities, 2, copies),
        roots=_rows(start.roots, 2, copies),
        root_twists=_rows(start.root_twists, 2, copies),
    )


def _rows(values: npt.ArrayLike | None, dimensions: int, copies: range) -> npt.ArrayLike | None:
    """The rows of these copies, of an array that has a row for each; one that is for all copies stays."""
    return values if values is None or np.ndim(values) != dimensions else np.asarray(values)[_slice(copies)]


def _slice(copies: range) -> slice:
    return slice(copies.start, copies.stop)


class Sharing:
    """Which parts are to be asked for, and what was answered. May be used from several threads."""

    def __init__(
        self, asked: Asked, copies: int, widths: Sequence[int], progress: Callable[[int, int], object] | None
    ) -> None:
        self._asked = asked
        self._copies = copies
        self._widths = widths
        self._progress = progress
        self._lock = threading.Lock()
        self._open: deque[range] = deque([range(copies)])
        self._found: dict[int, tuple[str, Rollout]] = {}
        self._done: dict[int, int] = {}
        self._reported = 0
        self._lost: Unavailable | DeadlineExceeded | None = None
        self._failed: tuple[int, Exception] | None = None
        self._is_stopped = False

    @property
    def is_whole(self) -> bool:
        """Whether all copies were answered."""
        with self._lock:
            return sum(len(found) for _, found in self._found.values()) == self._copies

    def cut(self, daemons: int) -> None:
        """Cuts what is open into parts for so many daemons. Raises what made the last round fail, or what the last daemon was lost
        by if there is none left."""
        with self._lock:
            if self._failed is not None:
                raise self._failed[1]
            if daemons == 0 and self._lost is not None:
                raise self._lost
            each = -(-sum(len(part) for part in self._open) // (daemons * PARTS_EACH))
            each = -(-each // TOGETHER) * TOGETHER
            self._open = deque(
                part[begin : begin + each] for part in self._open for begin in range(0, len(part), each)
            )

    def take(self) -> range | None:
        """Copies that are to be asked for; `None` if there are none, or it is over."""
        with self._lock:
            return self._open.popleft() if self._open and self._failed is None and not self._is_stopped else None

    def asked(self, copies: range) -> Asked:
        """What is to be asked of a daemon."""
        return self._asked.part(copies, self._widths)

    def report(self, copies: range, done: int) -> None:
        """Takes in how many of these copies are done."""
        with self._lock:
            self._done[copies.start] = done
            # It never goes back, also where a daemon was lost.
            count = max(self._reported, sum(self._done.values()))
            if self._progress is not None and count > self._reported:
                self._reported = count
                self._progress(count, self._copies)

    def add(self, copies: range, daemon: str, found: Rollout) -> None:
        """Takes the answer to a part."""
        with self._lock:
            self._found[copies.start] = daemon, found
            if sum(_bytes(each) for _, each in self._found.values()) > MOST_BYTES:
                self._fail(copies, AnswerError("the rollout is too large: observe less, or ask for fewer copies"))

    def give_back(self, copies: range, error: Unavailable | DeadlineExceeded) -> None:
        """A daemon is lost, or hangs: its part is to be asked of another one."""
        with self._lock:
            self._open.appendleft(copies)
            self._done.pop(copies.start, None)
            self._lost = error

    def fail(self, copies: range, daemon: str, error: SimdError) -> None:
        """A daemon refused: nothing more is asked for."""
        error.args = (f"daemon `{daemon}`: {error}",)
        with self._lock:
            self._fail(copies, error)

    def stop(self) -> None:
        """Nothing more is asked for."""
        with self._lock:
            self._is_stopped = True

    def _fail(self, copies: range, error: Exception) -> None:
        # That of the first copies, so that the same rollout fails in the same words.
        if self._failed is None or copies.start < self._failed[0]:
            self._failed = copies.start, error

    def rollout(self) -> Rollout:
        """All of it, once it is whole. Raises `ValueError` if daemons hold different states."""
        with self._lock:
            parts = [(begin, *self._found[begin]) for begin in sorted(self._found)]
        _, first_daemon, first = parts[0]
        for _, daemon, part in parts:
            if _kind(part) != _kind(first):
                raise ValueError(
                    f"the daemons `{first_daemon}` and `{daemon}` hold different saved states of the name "
                    f"`{self._asked.saved_state}`: copy one to the others by `share_state`"
                )
        found = [part for _, _, part in parts]
        ended = {begin + copy: why for begin, _, part in parts for copy, why in part.ended.items()}
        return Rollout(
            start=first.start,
            costs=np.concatenate([part.costs for part in found]),
            terms=np.concatenate([part.terms for part in found]),
            step_costs=np.concatenate([part.step_costs for part in found]),
            observations=tuple(
                np.concatenate([part.observations[index] for part in found])
                for index in range(len(first.observations))
            ),
            steps_done=np.concatenate([part.steps_done for part in found]),
            ended=dict(list(ended.items())[:MOST_ENDED]),
            processor_seconds=sum(part.processor_seconds for part in found),
            start_fingerprint=first.start_fingerprint,
        )


def silence(left: float) -> float:
    """How many seconds a daemon may say nothing, where so many are left for the whole: others can still do its part then."""
    return max(min(SILENT_SECONDS, left / 2), LEAST_SILENT_SECONDS)


def _bytes(found: Rollout) -> int:
    return found.terms.nbytes + found.step_costs.nbytes + sum(each.nbytes for each in found.observations)


def _kind(found: Rollout) -> tuple[object, ...]:
    """What parts of one rollout have in common."""
    shapes = tuple(each.shape[1:] for each in (found.terms, found.step_costs, *found.observations))
    return found.start.step, found.start.sim_time, found.start_fingerprint, shapes
