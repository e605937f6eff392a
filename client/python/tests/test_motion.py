"""Robots move to goals, and a program waits for them."""

from __future__ import annotations

import threading

import numpy as np
import pytest
from daemon import ASSETS, Daemon

import simd_client
from simd_client import Robot, Simulation, aio


def test_a_robot_moves_step_by_step_the_same_each_time(sim: Simulation, arm: Robot) -> None:
    start = sim.save_state()
    first = arm.move_to([0.3, -0.4], steps=10)
    np.testing.assert_allclose(first.position, [0.3, -0.4], atol=0.01)
    assert first.stamp.step % 10 == 0 and 0 < first.stamp.step
    sim.restore_state(start)
    again = arm.move_to({"shoulder joint": 0.3, "elbow joint": -0.4}, steps=10)
    assert again.position.tolist() == first.position.tolist()
    # It is at the goal already.
    assert arm.move_to(first.position, steps=10).stamp.step == again.stamp.step


def test_a_robot_moves_in_a_world_that_plays(sim: Simulation, arm: Robot) -> None:
    sim.play()
    state = arm.move_to({"elbow joint": "20deg"}, tolerance=0.02)
    assert abs(state["elbow joint"].position - np.radians(20)) <= 0.02


def test_a_slower_motion_takes_longer(sim: Simulation, arm: Robot) -> None:
    fast = arm.move_to({"elbow joint": 0.5}, steps=10).stamp.sim_time
    sim.reset(state=True, time=True)
    slow = arm.move_to({"elbow joint": 0.5}, steps=10, max_velocity=0.25).stamp.sim_time
    # At 0.25 rad/s half a radian takes two seconds.
    assert fast < 2.0 - 0.02 / 0.25 <= slow


def test_a_position_beyond_a_limit_is_the_limit(sim: Simulation, arm: Robot) -> None:
    limit = arm.joints["elbow joint"].limits.upper
    assert limit is not None
    state = arm.move_to({"elbow joint": 99.0}, steps=10)
    assert abs(state["elbow joint"].position - limit) <= 0.01


def test_a_robot_that_is_late_says_which_joint(sim: Simulation, arm: Robot) -> None:
    with pytest.raises(simd_client.DeadlineExceeded, match="within 0.02 simulated seconds: joint `elbow joint` is at"):
        arm.move_to({"shoulder joint": 0.0, "elbow joint": 1.0}, timeout=0.02, steps=10)
    assert sim.stamp.step == 20


def test_a_robot_that_something_blocks_says_what(sim: Simulation) -> None:
    arm = sim.load(ASSETS / "Bench_Arm-1.2 rev B", name="bench", fixed=True)
    sim.add_box((2.0, 2.0, 0.1), position=(0.0, 0.0, -0.15), name="floor", fixed=True)
    with pytest.raises(simd_client.DeadlineExceeded, match="joint `shoulder` is at .*; `floor` blocks joint `shoulder`"):
        arm.move_to({"shoulder": 1.5}, timeout=3.0, steps=10)
    blocked = sim.step(states=[arm])[arm]["shoulder"].blocked_by
    assert blocked is not None and (blocked.robot, blocked.link, blocked.own_link) == ("floor", "", "arm")
    sim.robot("floor").delete()
    assert arm.move_to({"shoulder": 1.5}, timeout=3.0, steps=10)["shoulder"].blocked_by is None


def test_a_paused_world_is_refused_at_once(sim: Simulation, arm: Robot) -> None:
    with pytest.raises(simd_client.WrongState, match="paused, so that robot `arm` does not move: play it") as refused:
        arm.move_to([0.3, 0.3])
    assert (refused.value.code, refused.value.reason) == ("FAILED_PRECONDITION", "WRONG_STATE")
    # A condition that is true already needs no motion.
    assert arm.wait_until(lambda _: True).stamp == sim.stamp


def test_a_world_that_is_paused_or_reset_on_the_way_ends_the_wait(sim: Simulation, arm: Robot) -> None:
    for change, error in ((sim.pause, simd_client.WrongState), (sim.reset, simd_client.Superseded)):
        sim.play()
        changed = False

        def never(_: object) -> bool:
            nonlocal changed
            if not changed:
                changed = True
                change()
            return False

        with pytest.raises(error):
            arm.wait_until(never, timeout=1000.0)


@pytest.mark.parametrize(
    ("positions", "options", "match"),
    [
        ([0.1], {}, "has 2 numbers"),
        ([0.1, float("nan")], {}, "`elbow joint` is a number, not nan"),
        ({}, {}, "no joint to move"),
        ([0.1, 0.1], {"tolerance": 0.0}, "above 0"),
        ([0.1, 0.1], {"timeout": float("nan")}, "not nan"),
        ({"elbow joint": "3 furlongs"}, {}, "not a number"),
    ],
)
def test_invalid_motions_are_refused(arm: Robot, positions: object, options: dict[str, float], match: str) -> None:
    with pytest.raises(ValueError, match=match):
        arm.move_to(positions, **options)  # pyright: ignore[reportArgumentType]


def test_a_joint_that_there_is_not_or_of_several_axes_is_refused(sim: Simulation, arm: Robot) -> None:
    with pytest.raises(simd_client.JointNotFound):
        arm.move_to({"knee": 0.1}, steps=1)
    planar = sim.load(ASSETS / "planar", "planar")
    joint = next(each for each in planar.joints.values() if each.info.dof == 3)
    with pytest.raises(ValueError, match="has 3 axes"):
        planar.move_to({joint.name: 0.1}, steps=1)


def test_two_threads_move_two_robots(sim: Simulation, arm: Robot) -> None:
    other = sim.load(ASSETS / "Two Link.v2", "other", fixed=True, position=(0, 2, 0))
    sim.play()
    moving = threading.Thread(target=lambda: other.move_to([0.2, 0.2], tolerance=0.02))
    moving.start()
    arm.move_to([-0.2, -0.2], tolerance=0.02)
    moving.join()
    np.testing.assert_allclose(other.position, [0.2, 0.2], atol=0.03)


async def test_asyncio_does_the_same(sim: Simulation, daemon: Daemon, arm: Robot) -> None:
    async with aio.connect(daemon.endpoint) as connected:
        same = await connected.robot("arm")
        state = await same.move_to([0.1, 0.2], steps=10)
        assert (await same.wait_until(lambda now: now.stamp.step >= state.stamp.step + 7, steps=7)).stamp.step == (
            state.stamp.step + 7
        )


def test_several_robots_are_reset_and_read_in_one_call(sim: Simulation, arm: Robot) -> None:
    other = sim.load(ASSETS / "Two Link.v2", "other", fixed=True, position=(0, 2, 0))
    sim.reset_joints({arm: [0.1, 0.2], other: {"elbow joint": "10deg"}}, {arm: [1.0, 2.0]})
    assert arm.position.tolist() == [0.1, 0.2] and arm.velocity.tolist() == [1.0, 2.0]
    assert other.position[1] == pytest.approx(np.radians(10))
    sim.reset_joints({arm: None})
    assert arm.position.tolist() == [0.0, 0.0]
    with pytest.raises(simd_client.RobotNotFound):
        sim.reset_joints({arm: [0.3, 0.3], "leg": None})
    assert arm.position.tolist() == [0.0, 0.0]
    with pytest.raises(ValueError, match="`other` is given velocities and no positions"):
        sim.reset_joints({arm: [0.3, 0.3]}, {other: [0.1, 0.1]})
    links = sim.link_states(arm, "other")
    assert list(links) == ["arm", "other"] and links["arm"].stamp == links["other"].stamp
    np.testing.assert_allclose(links["other"].poses[:, 1] - links["arm"].poses[:, 1], 2.0, atol=0.2)


def test_joint_properties_of_several_joints_are_set_in_one_call(arm: Robot) -> None:
    arm.set_joint_properties(damping=0.25)
    assert [joint.info.damping for joint in arm.joints.values() if joint.is_actuated] == [0.25, 0.25]
    arm.set_joint_properties("elbow joint", damping=0.5)
    assert [joint.info.damping for joint in arm.joints.values() if joint.is_actuated] == [0.25, 0.5]
