"""Results of the copies of a rollout."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simd_client import proto
from simd_client.errors import AnswerError
from simd_client.geometry import FloatArray
from simd_client.rollout import Observation
from simd_client.world import Stamp, stamp_from_proto

MAX_BYTES = 512 * 1024 * 1024
"""A larger answer is refused, so that a faulty daemon cannot fill the client's memory."""


@dataclass(frozen=True, eq=False)
class Rollout:
    """Results of the copies. Arrays begin with the index of the copy."""

    start: Stamp
    """Moment of the state that they started from."""
    costs: FloatArray
    """(copies): the sum of all terms over all steps; infinite if the copy ended early."""
    terms: FloatArray
    """(copies, terms): the same sum for each term."""
    step_costs: FloatArray
    """(copies, steps) if requested, or (copies, 0)."""
    observations: tuple[FloatArray, ...]
    """One for each requested observation: (copies, rows, numbers), or (copies, rows, links, 7) for link
    poses. NaN after a copy ended."""
    steps_done: npt.NDArray[np.uint32]
    """(copies): number of steps of each."""
    ended: Mapping[int, str]
    """First copies that ended early, with their reasons."""
    processor_seconds: float
    """Computing time of the daemon, over all its threads."""
    start_fingerprint: int
    """Hash of the copies' initial state: robots' poses, velocities, drives, names and masses. Equal states
    have equal hashes."""

    def __len__(self) -> int:
        return len(self.costs)


class Gathered:
    """A rollout with its parts that have arrived."""

    def __init__(self, result: proto.RolloutResult) -> None:
        self._result = result
        self._columns = sum(result.widths)
        self._shapes = (
            (result.copies, result.rows, self._columns),
            (result.copies, result.terms),
            (result.copies, result.steps if result.has_step_costs else 0),
        )
        if sum(_size(shape) for shape in self._shapes) * 8 > MAX_BYTES:
            raise AnswerError("the daemon's answer cannot be understood: the rollout is too large")
        self._arrays = [np.empty(_size(shape)) for shape in self._shapes]
        self._filled = [0, 0, 0]

    def add(self, part: proto.RolloutPart) -> None:
        """Adds a part. Raises `AnswerError` if it does not fit."""
        index = int(part.array) - 1
        if not 0 <= index < len(self._arrays) or len(part.data) % 8:
            raise AnswerError("the daemon's answer cannot be understood: a part of a rollout is of no array")
        numbers = np.frombuffer(part.data, dtype="<f8")
        begin = self._filled[index]
        end = begin + len(numbers)
        if end > len(self._arrays[index]):
            raise AnswerError("the daemon's answer cannot be understood: a rollout has more values than announced")
        self._arrays[index][begin:end] = numbers
        self._filled[index] = end

    @property
    def is_whole(self) -> bool:
        """Whether all parts have arrived."""
        return all(count == len(array) for count, array in zip(self._filled, self._arrays))

    def rollout(self, observations: Sequence[Observation]) -> Rollout:
        """Returns the whole answer, once it is complete."""
        result = self._result
        states, terms, step_costs = (
            array.reshape(shape) for array, shape in zip(self._arrays, self._shapes, strict=True)
        )
        if len(result.widths) != len(observations) or len(result.steps_done) != result.copies:
            raise AnswerError("the daemon's answer cannot be understood: it is of another rollout")
        ends = np.cumsum(np.array(result.widths, dtype=np.int64)).tolist()
        split: list[FloatArray] = []
        for begin, end, observation in zip([0, *ends], ends, observations):
            part = states[:, :, begin:end]
            if observation.of == "link_poses":
                part = part.reshape(result.copies, result.rows, (end - begin) // 7, 7)
            split.append(part)
        return Rollout(
            start=stamp_from_proto(result.start),
            costs=terms.sum(axis=1),
            terms=terms,
            step_costs=step_costs,
            observations=tuple(split),
            steps_done=np.array(result.steps_done, dtype=np.uint32),
            ended={each.copy: each.reason for each in result.ended},
            processor_seconds=result.processor_seconds,
            start_fingerprint=result.start_fingerprint,
        )


def _size(shape: Sequence[int]) -> int:
    size = 1
    for length in shape:
        size *= length
    return size
