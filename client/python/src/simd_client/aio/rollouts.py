"""Copies of the world that run on from one state, for controllers and learners."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from time import monotonic

from simd_client import proto
from simd_client.aio.queries import Queries
from simd_client.aio.runtime import replies, together
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
"""How much longer a rollout may take than other calls, by default."""


class Rollouts(Queries):
    """The part of a connection that has copies of the world run on."""

    async def rollout(
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
        """Has copies of the world do so many steps, each by its own controls, and says what became of them. The world itself is
        left as it is. Copies start from its present state, or from a saved one; what `controls` do not drive goes on as it is.

        How many copies there are follows from the arrays of `controls`, `starts` and `variations`, or is `copies`.
        `observe` is read after every `record_steps` steps (0: after the last one), and with `record_start` before the first. A
        copy's cost is the sum of `costs` over its steps; with `step_costs` that of each step is returned too. What is drawn
        depends on `seed` and the number of the copy alone.

        `progress` is called with the copies that are done, and with how many there are. Raises `LimitExceeded` for a rollout
        that is too large or takes too long. The default `timeout` is the connection's and 60 s.

        `daemons` are connections to others, which take parts of the copies: all start from the `saved_state` of this name that
        each of them holds (see `share_state`). The answer is that of one daemon, to the bit, where they are of one release on
        machines of one kind. The part of a daemon that is lost, or says nothing for 10 s or half of the time that is left, is
        asked of the others. Raises `Unavailable` or `DeadlineExceeded` if all are lost, and `ValueError` if their states differ.
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
            return await self._roll_out(asked, seconds, progress)
        if not asked.saved_state:
            raise ValueError(
                "daemons that share a rollout start from a saved state that all of them hold: give `saved_state`, and copy it "
                "to them by `share_state`"
            )
        widths = [await self._width(variation) for variation in variations]
        sharing = Sharing(asked, count, widths, progress)
        await self._share(sharing, [self, *daemons], seconds)
        return sharing.rollout()

    async def _share(self, sharing: Sharing, daemons: Sequence[Rollouts], seconds: float) -> None:
        """Has daemons do all parts; those that are lost in one round do not take part in the next one."""
        until = monotonic() + seconds
        here = list(daemons)
        try:
            sharing.cut(len(here))
            while not sharing.is_whole:
                lost: list[Rollouts] = []
                # The first part of each is settled beforehand, so that each has one if there are as many.
                works = [partial(each._do_parts, sharing, sharing.take(), until, lost, len(here) == 1) for each in here]
                await together(works)
                here = [each for each in here if each not in lost]
                sharing.cut(len(here))
        finally:
            sharing.stop()

    async def _do_parts(
        self, sharing: Sharing, part: range | None, until: float, lost: list[Rollouts], is_last: bool
    ) -> None:
        """Does a part, and others until there are none. The last daemon may say nothing for as long as there is time."""
        while part is not None:
            asked = sharing.asked(part)
            left = max(until - monotonic(), 0.001)
            try:
                found = await self._roll_out(
                    asked,
                    left,
                    lambda done, _, part=part: sharing.report(part, done),
                    None if is_last else silence(left),
                )
            except (Unavailable, DeadlineExceeded) as error:
                # Others would not have the time either: this one is named.
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

    async def _width(self, variation: Variation) -> int:
        """How many numbers a copy has of a variation that is drawn, by the daemon's rules."""
        if variation.values is not None:
            return 0
        if variation.of == "wrench":
            return 3
        robot = name_of(variation.robot)
        if variation.of in ("link_masses", "surface_friction"):
            request = proto.GetLinkPropertiesRequest(robot=robot)
            links = (await self.call(methods.GetLinkProperties, request)).links
            # What touches nothing has no surface.
            some = [each.link for each in links if variation.of == "link_masses" or each.HasField("friction")]
            return sum(name in some for name in variation.names) if variation.names else len(some)
        if variation.names:
            return len(variation.names)
        joints = (await self.layout(robot)).joints
        return sum(joint.type in ONE_AXIS and joint.mimic is None for joint in joints)

    async def _roll_out(
        self,
        asked: Asked,
        seconds: float,
        progress: Callable[[int, int], object] | None,
        silent: float | None = None,
    ) -> Rollout:
        """Has this daemon do a rollout. Raises `DeadlineExceeded` if it takes longer than `seconds`, or nothing is heard of it for
        `silent` seconds."""
        request = asked.request()
        method = methods.Rollout
        gathered: Gathered | None = None
        async for payload in replies(self._link, method, request.SerializeToString(), seconds, silent):
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
