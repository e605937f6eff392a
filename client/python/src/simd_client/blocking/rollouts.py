# Generated from simd_client/aio/rollouts.py by tools/make_blocking.py; do not edit.
"""Copies of the world that run from one state, for controllers and learners."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from time import monotonic

from simd_client import proto
from simd_client.blocking.queries import Queries
from simd_client.blocking.runtime import replies, together
from simd_client.errors import AnswerError, DeadlineExceeded, SimdError, Unavailable
from simd_client.layout import ONE_AXIS
from simd_client.method import decoded
from simd_client.proto import methods
from simd_client.rollout import Control, Cost, Observation, Start, Variation, copies_of
from simd_client.rollout_answer import Gathered, Rollout
from simd_client.rollout_share import LEAST_SILENT_SECONDS, Asked, Sharing, silence
from simd_client.state import name_of
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
        daemons: Sequence[Rollouts] = (),
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

        `daemons` are connections to other daemons, which take parts of the copies. All start from the
        `saved_state` of this name that each of them holds (see `share_state`). The answer equals a single
        daemon's bit for bit if all have one release and one kind of machine. If a daemon is lost, or is
        silent for 10 s or half of the remaining time, others do its part. Raises `Unavailable` or
        `DeadlineExceeded` if all are lost, and `ValueError` if their states differ.
        """
        asked = Asked(
            steps=steps,
            copies=copies,
            controls=controls,
            starts=starts,
            variations=variations,
            observe=observe,
            costs=costs,
            saved_state=saved_state if isinstance(saved_state, str) else saved_state.name,
            record_steps=record_steps,
            record_start=record_start,
            step_costs=step_costs,
            seed=seed,
        )
        seconds = self._timeout + ROLLOUT_SECONDS if timeout is None else timeout
        count = copies_of(copies, (*controls, *starts, *variations))
        if not daemons or count == 0:
            return self._roll_out(asked, seconds, progress)
        if not asked.saved_state:
            raise ValueError(
                "daemons that share a rollout start from a saved state that all of them hold: give `saved_state`, and copy it "
                "to them by `share_state`"
            )
        widths = [self._width(variation) for variation in variations]
        sharing = Sharing(asked, count, widths, progress)
        self._share(sharing, [self, *daemons], seconds)
        return sharing.rollout()

    def _share(self, sharing: Sharing, daemons: Sequence[Rollouts], seconds: float) -> None:
        """Has daemons do all parts; daemons that are lost in one round are left out of the next one."""
        until = monotonic() + seconds
        here = list(daemons)
        try:
            sharing.cut(len(here))
            while not sharing.is_whole:
                lost: list[Rollouts] = []
                # The first part of each daemon is assigned beforehand, so that each has one if there are
                # enough.
                works = [partial(each._do_parts, sharing, sharing.take(), until, lost, len(here) == 1) for each in here]
                together(works)
                here = [each for each in here if each not in lost]
                sharing.cut(len(here))
        finally:
            sharing.stop()

    def _do_parts(
        self, sharing: Sharing, part: range | None, until: float, lost: list[Rollouts], is_last: bool
    ) -> None:
        """Does a part, and others until none remain. The last daemon may be silent for all of the remaining
        time."""
        while part is not None:
            asked = sharing.asked(part)
            left = max(until - monotonic(), 0.001)
            try:
                found = self._roll_out(
                    asked,
                    left,
                    lambda done, _, part=part: sharing.report(part, done),
                    None if is_last else silence(left),
                )
            except (Unavailable, DeadlineExceeded) as error:
                # Other daemons would not have the time either: the error names this one.
                if isinstance(error, DeadlineExceeded) and until - monotonic() < LEAST_SILENT_SECONDS / 2:
                    sharing.fail(part, self.name, error)
                    return
                lost.append(self)
                sharing.give_back(part, error)
                return
            except SimdError as error:
                sharing.fail(part, self.name, error)
                return
            sharing.report(part, len(part))
            sharing.add(part, self.name, found)
            part = sharing.take()

    def _width(self, variation: Variation) -> int:
        """Returns how many numbers a copy has of a drawn variation, by the daemon's rules."""
        if variation.values is not None:
            return 0
        if variation.of == "wrench":
            return 3
        robot = name_of(variation.robot)
        if variation.of in ("link_masses", "surface_friction"):
            request = proto.GetLinkPropertiesRequest(robot=robot)
            links = self.call(methods.GetLinkProperties, request).links
            # Links without collision shapes have no surface.
            some = [each.link for each in links if variation.of == "link_masses" or each.HasField("friction")]
            return sum(name in some for name in variation.names) if variation.names else len(some)
        if variation.names:
            return len(variation.names)
        joints = self.layout(robot).joints
        return sum(joint.type in ONE_AXIS and joint.mimic is None for joint in joints)

    def _roll_out(
        self,
        asked: Asked,
        seconds: float,
        progress: Callable[[int, int], object] | None,
        silent: float | None = None,
    ) -> Rollout:
        """Has this daemon do a rollout. Raises `DeadlineExceeded` if it takes longer than `seconds`, or is
        silent for `silent` seconds."""
        request = asked.request()
        method = methods.Rollout
        gathered: Gathered | None = None
        for payload in replies(self._link, method, request.SerializeToString(), seconds, silent):
            answer = decoded(method.reply, payload)
            event = answer.WhichOneof("event")
            if event == "progress" and progress is not None:
                progress(answer.progress.done, answer.progress.copies)
            elif event == "result":
                gathered = Gathered(answer.result)
            elif event == "part" and gathered is not None:
                gathered.add(answer.part)
            if gathered is not None and gathered.is_whole:
                return gathered.rollout(asked.observe)
        raise AnswerError("the daemon's answer cannot be understood: the stream ended before the rollout was whole")
