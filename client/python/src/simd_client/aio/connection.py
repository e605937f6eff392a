"""A connection to a daemon: calls, layouts, joint states, targets and claims."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal

from simd_client import proto
from simd_client.aio.claim import Claim
from simd_client.aio.runtime import queries, query, query_until_silent
from simd_client.attributes import FixedAttributes
from simd_client.cache import Cache, HeldClaim
from simd_client.endpoint import Endpoint
from simd_client.errors import DeadlineExceeded, RobotNotFound, SimdError, Unavailable, refusal
from simd_client.layout import Layout, layout_from_proto
from simd_client.link import Link
from simd_client.link_states import LinkStates, link_states_from_proto
from simd_client.measurement import SensorReading, readings_from_proto
from simd_client.method import Method, Reply, Request, decoded
from simd_client.proto import methods
from simd_client.reset import JointValues, judged, resets_need_layout, resets_to_proto
from simd_client.retry import Sent
from simd_client.selection import Selection, SensorSelection, selections_to_proto, sensors_to_proto
from simd_client.state import (
    Applied,
    Clamped,
    Named,
    RobotState,
    States,
    clamped_from_proto,
    name_of,
    robot_state,
)
from simd_client.target import BeyondLimit, Targets, beyond_limit_to_proto, needs_layout, targets_to_proto
from simd_client.world import Stamp, stamp_from_proto


class Connection(FixedAttributes):
    """A connection to one daemon."""

    def __init__(self, link: Link, timeout: float, cache: Cache | None = None) -> None:
        self._link = link
        self._timeout = timeout
        self._cache = cache or Cache()

    @property
    def name(self) -> str:
        """The daemon's name."""
        return self._link.name

    @property
    def endpoint(self) -> Endpoint:
        """The daemon's address."""
        return self._link.endpoint

    @property
    def timeout(self) -> float:
        """Timeout of calls, in seconds."""
        return self._timeout

    @property
    def link(self) -> Link:
        """Link that carries the calls."""
        return self._link

    @property
    def cache(self) -> Cache:
        """Fetched layouts and held claims."""
        return self._cache

    async def call(self, method: Method[Request, Reply], request: Request, *, wait: float = 0.0) -> Reply:
        """Calls any method of the schema (`simd_client.proto.methods`) with its message. `wait` is the time,
        in seconds, that the request asks the daemon to wait."""
        self._cache.carry_claim(request)
        sent = self._link.request_ids.identified(method, request)
        if sent is None:
            payload = await query(self._link, method, request.SerializeToString(), self._timeout + wait)
            return decoded(method.reply, payload)
        try:
            payload = await query(self._link, method, sent.payload, self._timeout + wait)
        except (DeadlineExceeded, Unavailable) as error:
            error.sent = sent
            raise
        return decoded(method.reply, payload)

    async def call_until_silent(self, method: Method[Request, Reply], request: Request) -> Reply:
        """Like `call`, for work of the daemon that may take long: waits for as long as the daemon answers at
        all. Each time the timeout ends it is asked for its name. It bounds its work itself. Raises
        `DeadlineExceeded` once it is silent."""
        self._cache.carry_claim(request)
        sent = self._link.request_ids.identified(method, request)
        payload = request.SerializeToString() if sent is None else sent.payload
        try:
            reply = await query_until_silent(self._link, method, payload, self._timeout, self.alive)
        except (DeadlineExceeded, Unavailable) as error:
            error.sent = sent
            raise
        return decoded(method.reply, reply)

    @property
    def alive(self) -> tuple[Method[Any, Any], bytes]:
        """A question that the daemon answers at once: for its name."""
        return methods.GetSimulatorInfo, proto.GetSimulatorInfoRequest().SerializeToString()

    async def call_all(self, *calls: tuple[Method[Any, Any], Any]) -> list[Any]:
        """Makes several calls in one round trip, each a method with its message as for `call`. All are sent
        before the first answer is awaited; the daemon may execute them in any order, some concurrently.
        Returns their answers in the order of the calls. Raises the error of the first one that failed, once
        all are answered; the others are done. The daemon answers at most 1,024 calls concurrently."""
        requests: list[tuple[Method[Any, Any], bytes]] = []
        identified: list[Sent | None] = []
        for method, request in calls:
            self._cache.carry_claim(request)
            sent = self._link.request_ids.identified(method, request)
            identified.append(sent)
            requests.append((method, request.SerializeToString() if sent is None else sent.payload))
        payloads = await queries(self._link, requests, self._timeout)
        for payload, sent in zip(payloads, identified, strict=True):
            if isinstance(payload, (DeadlineExceeded, Unavailable)):
                payload.sent = sent
            if isinstance(payload, BaseException):
                raise payload
        answers = [payload for payload in payloads if isinstance(payload, bytes)]
        return [decoded(method.reply, answer) for (method, _), answer in zip(requests, answers, strict=True)]

    async def ask_again(self, error: SimdError, *, wait: float = 0.0) -> Any:
        """Asks about a call that ended with `DeadlineExceeded` or `Unavailable`. Returns its answer, as a
        message of `simd_client.proto`, or raises its refusal. If the daemon has executed the call, this is
        its first answer; otherwise the daemon executes it now. So the call is executed once, however often
        this is used. The daemon remembers the last 1,024 answers for an hour at most, and none from before a
        restart. `wait` is the time, in seconds, that it may take beyond the connection's timeout.

        Raises `ValueError` for a call that changes nothing, or that belongs to a loop (targets, fewer than
        100 steps). Make that call again, or read the stamp. The daemon never returns the secret of a claim
        twice, and answers with `RequestIdReused` instead.
        """
        sent = error.sent
        if sent is None:
            raise ValueError("the call of this error changes nothing, is one of a loop, or was answered: make it again")
        try:
            payload = await query(self._link, sent.method, sent.payload, self._timeout + wait)
        except (DeadlineExceeded, Unavailable) as again:
            again.sent = sent
            raise
        return decoded(sent.method.reply, payload)

    # Layouts.

    async def layout(self, robot: str) -> Layout:
        """Returns a robot's layout, fetched if it is not known or has changed. Raises `RobotNotFound`."""
        known = self._cache.fresh_layout(robot)
        return known if known is not None else await self.fetch_layout(robot)

    async def fetch_layout(self, robot: str) -> Layout:
        """Fetches and returns a robot's layout. Raises `RobotNotFound`."""
        answer = await self.call(methods.GetJointLayout, proto.GetJointLayoutRequest(robot=robot))
        fetched = layout_from_proto(answer.layout)
        self._cache.keep_layout(fetched)
        return fetched

    # States and targets.

    async def states(self, selection: Selection = None) -> States:
        """Returns the newest state immediately: of all robots, a robot, several, or joints by robot."""
        selected = selections_to_proto(selection)
        answer = await self.call(methods.GetJointStates, proto.GetJointStatesRequest(selections=selected))
        return await self.decode_states(answer.states, selected)

    async def next_states(
        self,
        after: Stamp | int = 0,
        wait: float = 1.0,
        selection: Selection = None,
        *,
        sensors: SensorSelection = False,
    ) -> States:
        """Returns the newest state once it is newer than `after`, or the current one after `wait` seconds, at
        most 60.

        `sensors` adds the newest readings to the states. It has names of sensors by robot, names that each
        selected robot has, or `True` for all. Each reading has a separate stamp."""
        sequence = after if isinstance(after, int) else after.sequence
        selected = selections_to_proto(selection)
        robots = [each.robot for each in selected]
        request = proto.NextJointStatesRequest(
            after_sequence=sequence, timeout=wait, selections=selected, sensors=sensors_to_proto(sensors, robots)
        )
        answer = await self.call(methods.NextJointStates, request, wait=wait or 1.0)
        return await self.decode_states(answer.states, selected, sensors=answer.sensors)

    async def decode_states(
        self,
        message: proto.JointStates,
        selected: Sequence[proto.JointSelection] = (),
        clamped: tuple[Clamped, ...] = (),
        sensors: Sequence[proto.SensorReadings] = (),
    ) -> States:
        """Converts states from their message. Fetches unknown layouts."""
        readings: dict[str, dict[str, SensorReading[Any]]] = {}
        for of in sensors:
            readings.setdefault(of.robot, {}).update((of.sensor, each) for each in readings_from_proto(of))
        stamp = stamp_from_proto(message.stamp)
        robots: dict[str, RobotState] = {}
        for index, each in enumerate(message.robots):
            names = tuple(selected[index].joints) if index < len(selected) else ()
            known = self._cache.fresh_layout(each.robot)
            if known is None or known.version != each.layout_version:
                try:
                    known = await self.fetch_layout(each.robot)
                except RobotNotFound:
                    # The robot was deleted since; its arrays are still useful.
                    known = Layout(each.robot, 0, (), 0, 0)
            robots[each.robot] = robot_state(each, stamp, known, names, readings.get(each.robot))
        return States(stamp, robots, clamped)

    async def set_targets(self, targets: Targets, *, beyond_limit: BeyondLimit = "clamp") -> Applied:
        """Sets targets for several robots: all of them at the same step, or none."""
        messages, claim = await self._encode_targets(targets)
        request = proto.SetJointTargetsRequest(
            robots=messages, limit_policy=beyond_limit_to_proto(beyond_limit), claim=claim
        )
        with self._cache.marking_stale():
            answer = await self.call(methods.SetJointTargets, request)
        return Applied(stamp_from_proto(answer.stamp), clamped_from_proto(answer.clamped))

    async def exchange(
        self,
        targets: Targets,
        *,
        states: Selection = None,
        wait: float = 1.0,
        beyond_limit: BeyondLimit = "clamp",
    ) -> States:
        """Executes one cycle of a controller on a playing world: sends targets and returns the first state
        stepped with them, in one round trip. After `wait` seconds it returns the current state (a paused
        world has no newer one); with 0 it returns immediately. `states` is a selection as in `states`."""
        messages, claim = await self._encode_targets(targets)
        selected = selections_to_proto(states)
        newer = proto.ControlWait.CONTROL_WAIT_NEWER_STATE if wait > 0 else proto.ControlWait.CONTROL_WAIT_NONE
        request = proto.ControlRequest(
            selections=selected,
            robots=messages,
            limit_policy=beyond_limit_to_proto(beyond_limit),
            claim=claim,
            wait=newer,
            timeout=wait,
        )
        with self._cache.marking_stale():
            answer = await self.call(methods.Control, request, wait=wait)
            if answer.HasField("refusal"):
                refused = answer.refusal
                reason = proto.ErrorReason.Name(refused.reason).removeprefix("ERROR_REASON_")
                raise refusal(refused.code, refused.message, reason, refused.metadata)
        return await self.decode_states(answer.states, selected, clamped_from_proto(answer.clamped))

    async def reset_joints(
        self,
        positions: Mapping[Any, JointValues | None],
        velocities: Mapping[Any, JointValues] | None = None,
        *,
        beyond_limit: BeyondLimit | Literal["keep"] = "clamp",
    ) -> Applied:
        """Sets positions and velocities of several robots' joints at once, by robot or its name: see
        `Robot.reset_joints`. All or none are set, in one round trip, and one more for each robot with an
        unknown layout."""
        moving = {name_of(robot): values for robot, values in (velocities or {}).items()}
        resets: list[proto.RobotReset] = []
        clamped: list[Clamped] = []
        for robot, at in positions.items():
            name = name_of(robot)
            velocity = moving.pop(name, None)
            needs_layout = resets_need_layout(at, velocity) or (at is not None and beyond_limit != "keep")
            layout = await self.layout(name) if needs_layout else None
            joints = resets_to_proto(layout, at, velocity)
            if layout is not None:
                clamped += judged(layout, joints, beyond_limit)
            resets.append(proto.RobotReset(robot=name, joints=joints))
        if moving:
            raise ValueError(f"robot `{next(iter(moving))}` is given velocities and no positions to start from")
        request = proto.ResetJointsRequest(robots=resets)
        return Applied(stamp_from_proto((await self.call(methods.ResetJoints, request)).stamp), tuple(clamped))

    async def link_states(self, *robots: str | Named) -> dict[str, LinkStates]:
        """Returns poses and velocities of all links of these robots, or of all, by robot name: all of one
        moment, in one round trip. They are in the order of `Robot.links`."""
        request = proto.GetLinkStatesRequest(robots=[name_of(robot) for robot in robots])
        answer = await self.call(methods.GetLinkStates, request)
        stamp = stamp_from_proto(answer.stamp)
        return {each.robot: link_states_from_proto(each, stamp) for each in answer.robots}

    async def stream_targets(self, targets: Targets) -> None:
        """Sends targets without waiting for an answer, for controllers that send them at a fixed rate. A target
        beyond a limit is clamped. The daemon counts a refusal and does not report it. If the network is
        congested, a message may be dropped."""
        messages, claim = await self._encode_targets(targets)
        request = proto.SetJointTargetsRequest(robots=messages, claim=claim)
        self._link.publish_targets(request.SerializeToString())

    async def claim(
        self,
        selection: Selection = None,
        *,
        world: bool = False,
        holder: str = "",
        lease: float = 10.0,
        priority: int = 0,
        take_over: bool = False,
        until_disconnect: bool = False,
    ) -> Claim:
        """Claims robots, joints or the world for this client. The claim lasts until it is released or was
        unused for `lease` seconds (0.1 to 3,600); with `until_disconnect` also until the connection ends. A
        robot without joint names is claimed whole. While another client holds a claim, only the holder of the
        world can pause, play, reset or restore it, or change its physics.

        `holder` is the name shown to other clients. Conflicting claims with a lower `priority` end; with
        `take_over`, which is for admins, claims of any priority end. Raises `JointClaimed`, `RobotClaimed` or
        `WorldClaimed` if another client holds one of them."""
        selected = selections_to_proto(selection)
        request = proto.ClaimJointsRequest(
            selections=selected,
            holder=holder or "simd_client",
            lease=lease,
            world=world,
            priority=priority,
            take_over=take_over,
            until_disconnect=until_disconnect,
        )
        answer = await self.call(methods.ClaimJoints, request)
        joints = ((each.robot, joint) for each in selected for joint in (tuple(each.joints) or ("",)))
        held = HeldClaim(answer.claim, frozenset(joints), world)
        self._cache.keep_claim(held)
        return Claim(self, held)

    async def _encode_targets(self, targets: Targets) -> tuple[list[proto.RobotTargets], str]:
        """Converts targets to messages, and returns the claim that they must carry."""
        messages: list[proto.RobotTargets] = []
        joints: list[tuple[str, str]] = []
        for robot, wanted in targets.items():
            name = name_of(robot)
            known = await self.layout(name) if needs_layout(wanted) else None
            messages.append(targets_to_proto(name, wanted, known))
            joints.extend((name, joint) for joint in (wanted if isinstance(wanted, Mapping) else ("",)))
        return messages, self._cache.claim_for(joints)
