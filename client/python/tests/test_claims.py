"""A claim keeps other clients off; an unused claim lapses."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from daemon import Daemon

import simd_client
from simd_client import Robot, Simulation, proto


def test_calls_carry_the_claim_and_others_are_refused(sim: Simulation, arm: Robot, daemon: Daemon) -> None:
    with simd_client.connect(daemon.endpoint) as other:
        rival = other.robot("arm")
        with arm.claim(holder="first"):
            arm.set_positions([0.1, 0.2])
            arm.joints["elbow joint"].target = 0.3
            sim.step(1, {arm: [0.1, 0.2]})
            with pytest.raises(simd_client.JointClaimed) as refused:
                rival.set_positions([0.0, 0.0])
            assert refused.value.metadata["holder"] == "first"
            with pytest.raises(simd_client.RobotClaimed):
                rival.claim()
            assert rival.refresh().joints[0].claimed_by == "first"
        rival.set_positions([0.4, 0.4])


def test_a_claim_of_one_joint_leaves_the_others_free(sim: Simulation, arm: Robot, daemon: Daemon) -> None:
    with simd_client.connect(daemon.endpoint) as other, arm.claim("elbow joint") as claim:
        assert repr(claim) == "<Claim of arm/elbow joint>" and claim.secret
        other.robot("arm").joints["shoulder joint"].target = 0.1
        with pytest.raises(simd_client.JointClaimed):
            other.robot("arm").joints["elbow joint"].target = 0.1
        arm.joints["shoulder joint"].target = 0.2
        with arm.claim("shoulder joint"), pytest.raises(ValueError, match="joints of two claims"):
            arm.set_positions([0.0, 0.0])


def test_an_unused_claim_lapses_and_its_end_is_no_error(sim: Simulation, arm: Robot) -> None:
    events = sim.events()
    with arm.claim(lease=0.1):
        kinds = [events.wait(20).kind, events.wait(20).kind]
        assert kinds == ["joints_claimed", "joints_released"]
        with pytest.raises(simd_client.ClaimNotFound):
            arm.set_positions([0.0, 0.0])
    arm.set_positions([0.0, 0.0])


def test_a_killed_client_leaves_nothing_behind(sim: Simulation, arm: Robot, daemon: Daemon) -> None:
    events = sim.events()
    script = (
        "import simd_client, sys\n"
        f"sim = simd_client.connect({daemon.endpoint!r})\n"
        "arm = sim.robot('arm')\n"
        "claim = arm.claim(lease=0.5)\n"
        "watch = arm.watch()\n"
        "next(watch)\n"
        "print('claimed', flush=True)\n"
        "sys.stdin.readline()\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", script], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "claimed\n"
        process.kill()
    assert events.wait(20).kind == "joints_claimed"
    released = events.wait(20)
    assert released.kind == "joints_released"
    assert released.detail.cause == proto.ReleaseCause.RELEASE_CAUSE_LAPSED
    arm.set_positions([0.1, 0.1])
    assert arm.refresh().joints[0].claimed_by == ""


def test_a_claimed_robot_is_changed_by_its_holder_alone(sim: Simulation, arm: Robot, daemon: Daemon) -> None:
    with simd_client.connect(daemon.endpoint) as other, arm.claim():
        rival = other.robot("arm")
        for change in (
            rival.reset_joints,
            rival.delete,
            rival.reload,
            lambda: rival.set_surface(friction=0.5),
            lambda: rival.set_state(simd_client.Pose(np.array([0.0, 0.0, 1.0]))),
        ):
            with pytest.raises((simd_client.RobotClaimed, simd_client.JointClaimed)):
                change()
        for pausing in (other.pause, other.play, other.reset):
            with pytest.raises(simd_client.WorldNotClaimed):
                pausing()
        # Its holder does all that without naming the claim.
        arm.reset_joints()
        arm.set_state(simd_client.Pose(np.array([0.0, 0.0, 1.0])))
        sim.pause()
        sim.step(1)
        arm.delete()


def test_the_world_is_claimed_beside_its_robots(sim: Simulation, arm: Robot, daemon: Daemon) -> None:
    with simd_client.connect(daemon.endpoint) as other, other.claim(world=True, holder="operator") as world:
        assert repr(world) == "<Claim of the world>"
        with pytest.raises(simd_client.WorldClaimed) as refused:
            sim.pause()
        assert refused.value.metadata["holder"] == "operator"
        with arm.claim():
            other.pause()
            other.step(1)
    sim.pause()


def test_a_claim_that_is_taken_over_is_lost_and_one_that_is_bound_ends_with_the_connection(
    sim: Simulation, arm: Robot, daemon: Daemon
) -> None:
    events = sim.events()
    low = arm.claim(priority=1)
    assert events.wait(20).kind == "joints_claimed"
    with simd_client.connect(daemon.endpoint) as other:
        other.claim({"arm": ()}, holder="safety", priority=2, lease=3600, until_disconnect=True)
        lost = events.wait(20).detail
        assert (lost.cause, lost.taken_over_by) == (proto.ReleaseCause.RELEASE_CAUSE_TAKEN_OVER, "safety")
        with pytest.raises(simd_client.ClaimNotFound):
            arm.set_positions([0.0, 0.0])
        assert events.wait(20).kind == "joints_claimed"
    assert events.wait(20).detail.cause == proto.ReleaseCause.RELEASE_CAUSE_DISCONNECTED
    with pytest.raises(simd_client.ClaimNotFound):
        low.release()
    arm.set_positions([0.0, 0.0])
