"""Daemons behind one router share a rollout, with the same result as one of them alone."""

from __future__ import annotations

import signal
import socket
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import zenoh
from daemon import ASSETS, Daemon

import simd_client
from simd_client import (
    Control,
    Cost,
    Feedback,
    Observation,
    Robot,
    Rollout,
    Simulation,
    Start,
    Variation,
    aio,
)

STATE = "shared"
GROUND = """<robot name="block"><link name="block"><inertial><mass value="1"/>
<inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="1 1 .2"/></geometry></collision></link></robot>"""


@pytest.fixture(scope="module")
def router() -> Iterator[str]:
    """Address of a Zenoh router in this process."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        locator = f"tcp/127.0.0.1:{free.getsockname()[1]}"
    settings: Any = zenoh.Config()
    settings.insert_json5("mode", '"router"')
    settings.insert_json5("listen/endpoints", f'["{locator}"]')
    settings.insert_json5("scouting/multicast/enabled", "false")
    session: Any = zenoh.open(settings)
    with session:
        yield locator


class Behind(Daemon):
    """A daemon that joins a router, and the connection to it through the router."""

    def __init__(self, router: str, name: str) -> None:
        super().__init__("--paused", "--zenoh-connect", router, name=name)
        self.sim = simd_client.connect(router, name)

    def end(self) -> None:
        """Ends both."""
        self.sim.close()
        if self.process.poll() is None:
            self.kill()


@pytest.fixture(scope="module")
def one(router: str) -> Iterator[Behind]:
    """Spawns an arm above a block, and saves a state of both."""
    behind = Behind(router, "one")
    sim = behind.sim
    sim.load(ASSETS / "Two Link.v2", "arm", fixed=True)
    sim.load_text(GROUND, "block", position=(5, 0, 0.1))
    sim.save_state(STATE)
    yield behind
    behind.end()


@pytest.fixture(scope="module")
def two(router: str, one: Behind) -> Iterator[Behind]:
    """Imports the saved state into an empty world."""
    behind = Behind(router, "two")
    one.sim.share_state(STATE, [behind.sim])
    yield behind
    behind.end()


def assert_equal(left: Rollout, right: Rollout) -> None:
    """Checks equality to the bit, except for the duration."""
    for name in ("costs", "terms", "step_costs", "steps_done"):
        np.testing.assert_array_equal(getattr(left, name), getattr(right, name), err_msg=name)
    assert len(left.observations) == len(right.observations)
    for mine, theirs in zip(left.observations, right.observations, strict=True):
        np.testing.assert_array_equal(mine, theirs)
    assert left.ended == right.ended and left.start == right.start


def test_a_shared_rollout_is_that_of_one_daemon_to_the_bit(one: Behind, two: Behind) -> None:
    random = np.random.default_rng(3)
    copies, knots = 75, 3
    arm = one.sim.robots["arm"]
    gains = random.normal(0.0, 1e-3, (copies, knots, 2, 4))
    asked: dict[str, Any] = {
        "controls": [
            Control(
                arm, random.normal(0.0, 0.3, (copies, knots, 2)), knot_steps=20, interpolation="linear",
                feedback=Feedback(gains, random.normal(0.0, 0.1, (copies, knots, 4))),
            )
        ],
        "starts": [Start(arm, random.normal(0.0, 0.2, (copies, 2)), [0.1, 0.2])],
        "variations": [
            Variation("joint_positions", arm, normal=(0.0, 0.1)),
            Variation("link_masses", arm, uniform=(0.8, 1.2)),
            # The tail of such a factor is clamped to its edge.
            Variation("joint_damping", arm, normal=(0.5, 1.0)),
            Variation("joint_friction", arm, arm.joint_names[:1], uniform=(0.0, 2.0)),
            Variation("gains", arm, normal=(1.0, 0.1)),
            Variation("surface_friction", "block", uniform=(0.5, 1.5)),
            Variation("wrench", "block", ["block"], normal=(0.0, 5.0), wrench_step=2, wrench_steps=10),
            Variation("joint_velocities", arm, values=random.normal(0.0, 0.1, (copies, 2))),
        ],
        "observe": [
            Observation("joint_positions", arm),
            Observation("link_poses", arm),
            Observation("root_pose", "block"),
        ],
        "record_steps": 7,
        "record_start": True,
        "costs": [Cost.joint_positions(arm), Cost.joint_efforts(arm, weight=0.1)],
        "step_costs": True,
        "seed": 2**64 - 5,
        "saved_state": STATE,
    }  # fmt: skip
    alone = one.sim.rollout(60, **asked)
    heard: list[tuple[int, int]] = []
    shared = one.sim.rollout(
        60, daemons=[two.sim], progress=lambda done, of: heard.append((done, of)), **asked
    )
    assert_equal(shared, alone)
    assert alone.ended == {}
    assert len(shared) == copies and len({float(cost) for cost in shared.costs}) == copies
    assert heard == sorted(heard) and heard[-1] == (copies, copies)
    assert list(two.sim.robots) == [], "the other world stays as it is"


async def test_asyncio_shares_too(one: Behind, two: Behind, router: str) -> None:
    asked: dict[str, Any] = {"variations": [Variation("joint_positions", "arm", normal=(0.0, 0.1))], "copies": 20}
    observe = [Observation("joint_positions", "arm")]
    alone = one.sim.rollout(5, observe=observe, saved_state=STATE, **asked)
    async with await aio.connect(router, "one") as left, await aio.connect(router, "two") as right:
        await left.share_state(STATE, [right])
        shared = await left.rollout(5, observe=observe, saved_state=STATE, daemons=[right], **asked)
    assert_equal(shared, alone)


def test_the_part_of_a_daemon_that_is_killed_is_asked_of_the_others(one: Behind, router: str) -> None:
    other = Behind(router, "other")
    try:
        one.sim.share_state(STATE, [other.sim])
        asked: dict[str, Any] = {
            "controls": [Control("arm", np.random.default_rng(1).normal(0.0, 0.3, (256, 10, 2)), knot_steps=100)],
            "variations": [Variation("link_masses", "arm", uniform=(0.8, 1.2))],
            "observe": [Observation("joint_positions", "arm")],
            "saved_state": STATE,
        }
        alone = one.sim.rollout(1000, **asked)

        def kill(done: int, of: int) -> None:
            """Kills the daemon once some copies are done: of eight parts the other daemon then has one."""
            if other.process.poll() is None:
                assert 0 < done < of
                other.kill()

        shared = one.sim.rollout(1000, daemons=[other.sim], progress=kill, **asked)
        assert_equal(shared, alone)
        assert other.process.poll() is not None
        with pytest.raises(simd_client.Unavailable, match="`other`"):
            other.sim.rollout(1, daemons=[other.sim], **asked)
    finally:
        other.end()


def test_the_part_of_a_daemon_that_hangs_is_asked_of_the_others(one: Behind, router: str) -> None:
    other = Behind(router, "hung")
    try:
        one.sim.share_state(STATE, [other.sim])
        asked: dict[str, Any] = {
            "controls": [Control("arm", np.random.default_rng(2).normal(0.0, 0.3, (64, 1, 2)))],
            "observe": [Observation("joint_positions", "arm")],
            "saved_state": STATE,
        }
        alone = one.sim.rollout(20, **asked)
        other.process.send_signal(signal.SIGSTOP)
        shared = one.sim.rollout(20, daemons=[other.sim], timeout=4.0, **asked)
        assert_equal(shared, alone)
        with pytest.raises(simd_client.DeadlineExceeded, match="`hung` said nothing for 1 s"):
            other.sim.rollout(20, daemons=[other.sim], timeout=2.0, **asked)
    finally:
        other.process.send_signal(signal.SIGCONT)
        other.end()


def test_states_of_one_moment_that_differ_are_not_mixed(one: Behind, two: Behind) -> None:
    one.sim.save_state("posed")
    one.sim.share_state("posed", [two.sim])
    asked: dict[str, Any] = {"copies": 16, "saved_state": "posed", "daemons": [two.sim]}
    assert len(one.sim.rollout(1, **asked)) == 16
    two.sim.restore_state("posed")
    try:
        two.sim.robots["arm"].reset_joints([0.3, -0.2])
        two.sim.save_state("posed")
        with pytest.raises(ValueError, match="`one` and `two` hold different saved states of the name `posed`"):
            one.sim.rollout(1, **asked)
    finally:
        for robot in list(two.sim.robots.values()):
            robot.delete()


def test_unshareable_rollouts_are_reported(one: Behind, two: Behind) -> None:
    with pytest.raises(ValueError, match="give `saved_state`, and copy it to them by `share_state`"):
        one.sim.rollout(1, copies=8, daemons=[two.sim])
    one.sim.save_state("mine")
    with pytest.raises(simd_client.SavedStateNotFound, match="^daemon `two`: .*mine"):
        one.sim.rollout(1, copies=16, saved_state="mine", daemons=[two.sim])
    two.sim.save_state("mine")
    two.sim.step(1)
    two.sim.save_state("mine")
    with pytest.raises(ValueError, match="`one` and `two` hold different saved states of the name `mine`"):
        one.sim.rollout(1, copies=16, saved_state="mine", daemons=[two.sim])
    with pytest.raises(simd_client.LimitExceeded):
        one.sim.rollout(2_000_000, copies=16, saved_state=STATE, daemons=[two.sim])
    with pytest.raises(simd_client.InvalidValue, match="uniform"):
        low = Variation("link_masses", "arm", uniform=(2.0, 1.0))
        one.sim.rollout(1, copies=64, variations=[low], saved_state=STATE, daemons=[two.sim])
    with pytest.raises(simd_client.InvalidValue):
        one.sim.rollout(1, copies=0, saved_state=STATE, daemons=[two.sim])


def test_an_environment_of_several_daemons_is_that_of_one(one: Behind, two: Behind) -> None:
    pytest.importorskip("gymnasium")
    from simd_client.gymnasium import RolloutEnv

    def observed(*daemons: Simulation) -> Any:
        arm: Robot = one.sim.robots["arm"]
        envs = RolloutEnv(
            one.sim, arm, copies=24, limit=2.0, steps=5, costs=[Cost.joint_positions(arm)], spread=0.1,
            saved_state=STATE, daemons=daemons,
        )  # fmt: skip
        envs.reset(seed=7)
        observations, rewards, *_ = envs.step(np.full((24, 2), 0.5))
        return np.column_stack([observations, rewards])

    np.testing.assert_array_equal(observed(two.sim), observed())
