"""`simd_client.testing`: waiting in simulated time, and assertions with units."""

from __future__ import annotations

import threading

import pytest

from simd_client import Robot, Simulation, Superseded, testing
from simd_client.testing import assert_efforts, assert_link_at, assert_positions, assert_velocities, until

ELBOW = "elbow joint"


def test_until_steps_a_paused_world_until_its_condition_is_true(sim: Simulation, arm: Robot) -> None:
    arm.set_positions({ELBOW: 0.5})
    found = until(lambda: [joint for joint in arm.read() if joint.position > 0.3], timeout=5.0, steps=5, sim=sim)
    assert [joint.name for joint in found] == [ELBOW]
    assert sim.stamp.step % 5 == 0 and sim.stamp.step > 0
    assert until(lambda: 7, timeout=0.0, sim=sim) == 7


def test_until_ends_after_simulated_seconds(sim: Simulation, arm: Robot) -> None:
    with pytest.raises(AssertionError, match=r"within 0\.5 simulated seconds the condition did not become true, it is False"):
        until(lambda: arm.joints[ELBOW].position > 9.0, timeout=0.5, sim=sim)
    assert sim.stamp.step == 500
    with pytest.raises(AssertionError, match="None: does the condition return its result"):
        until(lambda: None, timeout=0.1, sim=sim)


def test_until_waits_for_an_assertion_and_reports_the_last_one(sim: Simulation, arm: Robot) -> None:
    applied = arm.set_positions({ELBOW: 0.5})
    until(lambda: assert_positions(arm, {ELBOW: 0.5}, within=0.001, after=applied), timeout=5.0, sim=sim)
    with pytest.raises(AssertionError, match=r"s after the target\n\(waited for it for 0\.2 simulated seconds\)"):
        until(lambda: assert_positions(arm, {ELBOW: 0.9}, within=0.001, after=applied), timeout=0.2, sim=sim)


def test_until_waits_for_a_world_that_plays(sim: Simulation, arm: Robot) -> None:
    sim.play()
    arm.set_positions({ELBOW: 0.5})
    until(lambda: assert_positions(arm, {ELBOW: 0.5}, within=0.01), timeout=20.0, sim=sim)
    before = sim.stamp.sim_time
    with pytest.raises(AssertionError, match="did not become true"):
        until(lambda: False, timeout=0.1, sim=sim)
    assert sim.stamp.sim_time >= before + 0.1


def test_until_says_that_the_world_was_reset(sim: Simulation) -> None:
    def reset() -> bool:
        sim.reset(time=True)
        return False

    with pytest.raises(Superseded, match="while `until` waited"):
        until(reset, sim=sim)


def test_until_has_the_world_that_was_chosen(sim: Simulation) -> None:
    with pytest.raises(ValueError, match="give `sim=`"):
        until(lambda: True)
    testing.use(sim)
    try:
        found: list[bool] = []
        thread = threading.Thread(target=lambda: found.append(until(lambda: sim.stamp.step >= 20)))
        thread.start()
        thread.join()
        assert found == [True]
    finally:
        testing.use(None)
    with pytest.raises(ValueError, match="timeout=-1"):
        until(lambda: True, -1.0, sim=sim)


def test_assertions_say_how_far_off_a_joint_is(sim: Simulation, arm: Robot) -> None:
    sim.set_physics(gravity=(0, 0, 0))
    arm.reset_joints({ELBOW: 0.48, "shoulder joint": 0.1})
    arm.set_passive()
    applied = arm.set_efforts({ELBOW: 0.0})
    sim.step(2)
    assert assert_positions(arm, {ELBOW: "0.48rad"}, within="1deg")[ELBOW].position == pytest.approx(0.48, abs=1e-3)
    with pytest.raises(AssertionError) as wrong:
        assert_positions(arm, {ELBOW: 0.5}, within=0.01, after=applied)
    assert str(wrong.value) == f"joint `{ELBOW}` of `arm` is at 0.48 rad, wanted 0.5 within 0.01, 0.002 s after the target"
    with pytest.raises(AssertionError, match=r"`shoulder joint` of `arm` is at 0\.1 rad, wanted 0\.2 .*; joint `elbow joint`"):
        assert_positions(arm, [0.2, 0.2], within=0.01)
    with pytest.raises(AssertionError, match=r"moves at -?0 rad/s, wanted 3\.14 \(30rpm\) within 0\.1, at 0\.002 s"):
        assert_velocities(arm, {ELBOW: "30rpm"}, within=0.1)
    with pytest.raises(AssertionError, match=r"has 0 N m, wanted 2 \(2Nm\) within 0\.5"):
        assert_efforts(arm, {ELBOW: "2Nm"}, within="0.5Nm")


def test_assertions_refuse_what_cannot_be_meant(arm: Robot) -> None:
    with pytest.raises(ValueError, match="no joint"):
        assert_positions(arm, {}, within=0.01)
    with pytest.raises(ValueError, match="above 0"):
        assert_positions(arm, {ELBOW: 0.0}, within=0.0)
    with pytest.raises(ValueError, match="does not fit joint"):
        assert_positions(arm, {ELBOW: "3mm"}, within=0.01)
    with pytest.raises(LookupError, match="no joint `elbo`"):
        assert_positions(arm, {"elbo": 0.0}, within=0.01)
    with pytest.raises(ValueError, match="has no link `hand`"):
        assert_link_at(arm, "hand", (0, 0, 0), within=0.01)


def test_a_link_is_asserted_to_be_at_a_place(arm: Robot) -> None:
    pose = arm.link_poses()["forearm"]
    assert (assert_link_at(arm, "forearm", pose.position, within="1mm").position == pose.position).all()
    away = pose.position + (0.0, 0.0, 0.0128)
    with pytest.raises(AssertionError, match=r"link `forearm` of `arm` is at \S+ \S+ \S+ m, 0\.013 m from \S+ \S+ \S+, wanted within 0\.01 m, at 0 s"):
        assert_link_at(arm, "forearm", away, within="10mm")
