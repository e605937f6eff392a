"""A rollout that several daemons share: remaining copies, and one answer of all parts."""

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
from simd_client.rollout_answer import MAX_BYTES, Rollout
from simd_client.rollout_draws import drawn

TOGETHER = 8
"""Maximum number of copies that a processor steps at one time; parts have a multiple of them."""

PARTS_EACH = 4
"""Parts for each daemon. More parts cost more round trips; with fewer, the others wait longer for a slow
daemon."""

SILENT_SECONDS = 10.0
"""Seconds of silence after which a daemon counts as hung. Daemons report progress four times a second."""

LEAST_SILENT_SECONDS = 1.0
"""Minimum of that time, even if little time remains."""

MAX_REASONS = 16
"""Maximum number of early ends with reasons in an answer, equal to the daemon's."""


@dataclass(frozen=True, eq=False)
class Asked:
    """A rollout as a program requests it."""

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
        """Converts to a message. Raises the `ValueError` of `rollout_to_proto`."""
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
        """Returns the request for only these copies, with the same numbers. `widths` has the count of
        numbers per copy of each drawn variation."""
        variations = [
            replace(each, values=_rows(each.values, 2, copies))
            # A daemon counts copies from 0. It draws for the first ones itself, and refuses with its own
            # message.
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
    """Returns the rows of these copies, if the array has a row for each; an array for all copies is returned
    unchanged."""
    return values if values is None or np.ndim(values) != dimensions else np.asarray(values)[_slice(copies)]


def _slice(copies: range) -> slice:
    return slice(copies.start, copies.stop)


class Sharing:
    """Open parts and their answers. May be used from several threads."""

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
        """Divides the open copies into parts for `daemons` daemons. Raises the error of the last round, or
        the last lost daemon's if none is left."""
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
        """Takes copies to request; `None` if none are left, or the rollout has ended."""
        with self._lock:
            return self._open.popleft() if self._open and self._failed is None and not self._is_stopped else None

    def asked(self, copies: range) -> Asked:
        """Returns the request to a daemon."""
        return self._asked.part(copies, self._widths)

    def report(self, copies: range, done: int) -> None:
        """Records the number of finished copies."""
        with self._lock:
            self._done[copies.start] = done
            # It never decreases, even if a daemon is lost.
            count = max(self._reported, sum(self._done.values()))
            if self._progress is not None and count > self._reported:
                self._reported = count
                self._progress(count, self._copies)

    def add(self, copies: range, daemon: str, found: Rollout) -> None:
        """Takes the answer to a part."""
        with self._lock:
            self._found[copies.start] = daemon, found
            if sum(_bytes(each) for _, each in self._found.values()) > MAX_BYTES:
                self._fail(copies, AnswerError("the rollout is too large: observe less, or ask for fewer copies"))

    def give_back(self, copies: range, error: Unavailable | DeadlineExceeded) -> None:
        """Records a lost or hung daemon: another one must do its part."""
        with self._lock:
            self._open.appendleft(copies)
            self._done.pop(copies.start, None)
            self._lost = error

    def fail(self, copies: range, daemon: str, error: SimdError) -> None:
        """Records a refusal of a daemon: no further parts are requested."""
        error.args = (f"daemon `{daemon}`: {error}",)
        with self._lock:
            self._fail(copies, error)

    def stop(self) -> None:
        """Stops the rollout: no further parts are requested."""
        with self._lock:
            self._is_stopped = True

    def _fail(self, copies: range, error: Exception) -> None:
        # The error of the first copies, so that the same rollout always fails with the same message.
        if self._failed is None or copies.start < self._failed[0]:
            self._failed = copies.start, error

    def rollout(self) -> Rollout:
        """Returns the whole answer, once it is complete. Raises `ValueError` if daemons hold different
        states."""
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
            ended=dict(list(ended.items())[:MAX_REASONS]),
            processor_seconds=sum(part.processor_seconds for part in found),
            start_fingerprint=first.start_fingerprint,
        )


def silence(left: float) -> float:
    """Returns the allowed seconds of silence of a daemon, given the seconds left for the whole. Others can
    still do its part then."""
    return max(min(SILENT_SECONDS, left / 2), LEAST_SILENT_SECONDS)


def _bytes(found: Rollout) -> int:
    return found.terms.nbytes + found.step_costs.nbytes + sum(each.nbytes for each in found.observations)


def _kind(found: Rollout) -> tuple[object, ...]:
    """Returns the common properties of one rollout's parts."""
    shapes = tuple(each.shape[1:] for each in (found.terms, found.step_costs, *found.observations))
    return found.start.step, found.start.sim_time, found.start_fingerprint, shapes
