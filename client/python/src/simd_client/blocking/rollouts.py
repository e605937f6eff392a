# Generated from simd_client/aio/rollouts.py by tools/make_blocking.py; do not edit.
"""Copies of the world that run from one state, for controllers and learners."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from simd_client.blocking.queries import Queries
from simd_client.blocking.runtime import replies
from simd_client.errors import AnswerError
from simd_client.method import decoded
from simd_client.proto import methods
from simd_client.rollout import Control, Cost, Observation, Start, Variation, rollout_to_proto
from simd_client.rollout_answer import Gathered, Rollout
from simd_client.world import SavedState

ROLLOUT_SECONDS = 60.0
"""Default time, in seconds, that a rollout may take beyond other calls."""


class Rollouts(Queries):
    """The part of a connection that runs copies of the world."""

    def rollout(
        self,
        steps: int,
        controls: Sequence[Control] = (),
        *,
        copies: int | None = None,
        starts: Sequence[Start] = (),
        variations: Sequence[Variation] = (),
        observe: Sequence[Observation] = (),
        record_steps: int = 0,
        record_start: bool = False,
        costs: Sequence[Cost] = (),
        step_costs: bool = False,
        seed: int = 0,
        saved_state: str | SavedState = "",
        timeout: float | None = None,
        progress: Callable[[int, int], object] | None = None,
    ) -> Rollout:
        """Steps copies of the world, each with separate controls, and returns their results. The world does
        not change. Copies start from its present state, or from a saved one; joints that `controls` do not
        drive keep their targets.

        The number of copies follows from the arrays of `controls`, `starts` and `variations`, or is `copies`.
        `observe` is read after every `record_steps` steps (0: after the last one), and with `record_start`
        before the first. A copy's cost is the sum of `costs` over its steps; with `step_costs` the cost of
        each step is returned too. Random draws depend only on `seed` and the index of the copy.

        `progress` is called with the number of finished copies and the total. Raises `LimitExceeded` for a
        rollout that is too large or takes too long. The default `timeout` is the connection's and 60 s.
        """
        request = rollout_to_proto(
            steps,
            copies,
            controls,
            starts,
            variations,
            observe,
            costs,
            saved_state=saved_state if isinstance(saved_state, str) else saved_state.name,
            record_steps=record_steps,
            record_start=record_start,
            step_costs=step_costs,
            seed=seed,
        )
        seconds = self._timeout + ROLLOUT_SECONDS if timeout is None else timeout
        method = methods.Rollout
        gathered: Gathered | None = None
        for payload in replies(self._link, method, request.SerializeToString(), seconds):
            answer = decoded(method.reply, payload)
            event = answer.WhichOneof("event")
            if event == "progress" and progress is not None:
                progress(answer.progress.done, answer.progress.copies)
            elif event == "result":
                gathered = Gathered(answer.result)
            elif event == "part" and gathered is not None:
                gathered.add(answer.part)
            if gathered is not None and gathered.is_whole:
                return gathered.rollout(observe)
        raise AnswerError("the daemon's answer cannot be understood: the stream ended before the rollout was whole")
