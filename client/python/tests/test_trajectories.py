"""Trajectories that the daemon executes."""

from __future__ import annotations

import numpy as np
import pytest

from simd_client import (
    DeadlineExceeded,
    Gains,
    InvalidValue,
    Robot,
    Simulation,
    TrajectoryOutcome,
    TrajectoryStatus,
)


def test_joints_follow_rows_of_arrays_and_the_end_is_reported(sim: Simulation, arm: Robot) -> None:
    times = np.linspace(0.1, 1.0, 10)
    # From rest to rest.
    along = 10 * times**3 - 15 * times**4 + 6 * times**5
    speed = 30 * times**2 - 60 * times**3 + 30 * times**4
    goal = np.array([0.4, -0.3])
    trajectory = arm.follow(times, np.outer(along, goal), np.outer(speed, goal), path_tolerance=0.05, goal_tolerance=0.02)
    with pytest.raises(DeadlineExceeded):
        trajectory.wait(timeout=0.01)
    sim.step(500)
    assert np.allclose(arm.position, goal / 2, atol=0.01)
    sim.step(600)
    result = trajectory.wait(timeout=20)
    assert result.succeeded and result.stamp.sim_time == pytest.approx(1.0, abs=0.1)
    assert np.allclose(arm.position, goal, atol=0.02)
    with pytest.raises(InvalidValue):
        trajectory.cancel()


def test_one_can_be_cancelled_queued_and_superseded(sim: Simulation, arm: Robot) -> None:
    shoulder = arm.joint_names[0]
    first = arm.follow([1.0], [[0.4]], joints=[shoulder])
    second = arm.follow([1.0], [[0.0]], joints=[shoulder], queued=True)
    sim.step(100)
    first.cancel()
    assert first.wait(timeout=20).outcome is TrajectoryOutcome.CANCELLED
    assert second.wait(timeout=20).outcome is TrajectoryOutcome.CANCELLED
    third = arm.follow([1.0], [[0.4]], joints=[shoulder])
    sim.step(100)
    arm.joints[shoulder].target = 0.0
    assert third.wait(timeout=20).outcome is TrajectoryOutcome.SUPERSEDED
    fourth = arm.follow([1.0], [[0.4]], joints=[shoulder], delay=0.5)
    arm.cancel_trajectories()
    assert "request" in fourth.wait(timeout=20).message


def test_how_far_one_is_can_be_asked(sim: Simulation, arm: Robot) -> None:
    first = arm.follow([0.5], [[0.4, -0.2]])
    second = arm.follow([1.0], [[0.0, 0.0]], queued=True)
    sim.step(250)
    progress = first.progress()
    assert progress is not None and progress.status is TrajectoryStatus.ACTIVE
    assert (progress.elapsed, progress.duration) == pytest.approx((0.25, 0.5))
    assert progress.joints == arm.joint_names and progress.desired == pytest.approx([0.2, -0.1])
    assert np.array_equal(progress.actual, arm.position)
    assert [(each.id, each.status) for each in arm.trajectories()] == [
        (first.id, TrajectoryStatus.ACTIVE),
        (second.id, TrajectoryStatus.QUEUED),
    ]
    sim.step(300)
    assert first.progress() is None


def test_a_soft_spring_comes_to_its_target_where_gravity_is_compensated(sim: Simulation, arm: Robot) -> None:
    arm.set_joint_properties(default_gains=Gains(2.0, 0.5), friction=0.0)
    arm.set_positions([0.3, 0.2])
    sim.step(5000)
    sag = np.abs(arm.position - [0.3, 0.2]).max()
    arm.set_joint_properties(gravity_compensation=True)
    assert all(joint.info.gravity_compensation for joint in arm.joints.values())
    sim.step(10000)
    assert sag > 0.01 and np.abs(arm.position - [0.3, 0.2]).max() < 1e-6


def test_shapes_that_do_not_fit_are_refused_before_anything_is_sent(sim: Simulation, arm: Robot) -> None:
    with pytest.raises(ValueError, match="velocities have the shape"):
        arm.follow([1.0, 2.0], np.zeros((2, 2)), np.zeros((1, 2)))
    with pytest.raises(ValueError, match="times have the shape"):
        arm.follow(1.0, [[0.0, 0.0]])
    with pytest.raises(InvalidValue):
        arm.follow([2.0, 1.0], np.zeros((2, 2)))
