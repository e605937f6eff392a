"""Trajectories that the daemon carries out."""

from __future__ import annotations

import numpy as np
import pytest

from simd_client import DeadlineExceeded, InvalidValue, Robot, Simulation, TrajectoryOutcome


def test_joints_follow_rows_of_arrays_and_the_end_is_told(sim: Simulation, arm: Robot) -> None:
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


def test_shapes_that_do_not_fit_are_refused_before_anything_is_sent(sim: Simulation, arm: Robot) -> None:
    with pytest.raises(ValueError, match="velocities have the shape"):
        arm.follow([1.0, 2.0], np.zeros((2, 2)), np.zeros((1, 2)))
    with pytest.raises(ValueError, match="times have the shape"):
        arm.follow(1.0, [[0.0, 0.0]])
    with pytest.raises(InvalidValue):
        arm.follow([2.0, 1.0], np.zeros((2, 2)))
