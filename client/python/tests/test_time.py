"""Time runs, stops, is stepped and is reset."""

from __future__ import annotations

import threading

import numpy as np
import pytest

import simd_client
from simd_client import Integrator, Pace, Robot, Simulation, SimulationState, Target


def test_a_turn_of_a_loop_is_one_call(sim: Simulation, arm: Robot) -> None:
    sim.set_physics(gravity=(0, 0, 0))
    result = sim.step(10, {arm: {"elbow joint": Target.velocity(0.5)}}, states=arm)
    assert result.stamp.step == 10
    assert result[arm]["elbow joint"].velocity == pytest.approx(0.5, rel=0.01)
    assert result[arm].stamp == result.stamp and list(result) == ["arm"]
    clamped = sim.step(1, {"arm": [0.0, 9.0]}, states={"arm": ["elbow joint"]})
    assert clamped.clamped[0].applied == 2.4
    assert clamped["arm"].position.shape == (1,)
    assert len(sim.step(1)) == 0
    assert sim.step(1, states=True)[arm].position.shape == (2,)


def test_refused_targets_do_no_steps(sim: Simulation, arm: Robot) -> None:
    with pytest.raises(simd_client.TargetBeyondLimit):
        sim.step(5, {arm: [0.0, 9.0]}, beyond_limit="refuse")
    assert sim.stamp.step == 0


def test_a_playing_world_is_not_stepped(sim: Simulation) -> None:
    sim.play()
    assert sim.state is SimulationState.PLAYING
    with pytest.raises(simd_client.WrongState):
        sim.step()
    sim.pause()
    assert sim.state is SimulationState.PAUSED


def test_a_pause_ends_steps_that_are_under_way(sim: Simulation, arm: Robot) -> None:
    refused: list[simd_client.SimdError] = []

    def step() -> None:
        try:
            sim.step(100_000)
        except simd_client.SimdError as error:
            refused.append(error)

    thread = threading.Thread(target=step)
    thread.start()
    while sim.stamp.step == 0:
        pass
    sim.pause()
    thread.join(timeout=20)
    assert isinstance(refused[0], simd_client.Superseded)


def test_the_world_is_put_back_by_scope(sim: Simulation, arm: Robot) -> None:
    arm.set_passive()
    sim.step(50)
    moved = arm.position
    assert np.any(moved != 0)
    assert sim.reset(time=True).step == 0
    np.testing.assert_array_equal(arm.position, moved)
    sim.reset(state=True)
    np.testing.assert_array_equal(arm.position, [0, 0])
    assert sim.stop().step == 0
    assert sim.state is SimulationState.STOPPED
    sim.reset(spawned=True)
    assert sim.robots == {}


def test_settings_change_one_by_one_or_not_at_all(sim: Simulation) -> None:
    assert sim.physics.integrator == Integrator.LEAPFROG
    assert sim.set_physics(integrator="euler").integrator == Integrator.EULER
    with pytest.raises(ValueError, match="rk4"):
        sim.set_physics(integrator="rk4")
    changed = sim.set_physics(time_step=0.002, pace=Pace.AS_FAST_AS_POSSIBLE)
    assert changed.integrator == Integrator.EULER
    assert (changed.time_step, changed.substeps, changed.pace) == (0.002, 1, Pace.AS_FAST_AS_POSSIBLE)
    assert sim.set_physics(gravity=[0, 1, 0]).time_step == 0.002
    with pytest.raises(simd_client.InvalidValue):
        sim.set_physics(gravity=(0, 0, 0), time_step=-1.0)
    assert sim.physics.gravity.tolist() == [0, 1, 0]
    with pytest.raises(ValueError):
        sim.set_physics(pace="slow")


def test_a_saved_state_puts_the_world_back(sim: Simulation, arm: Robot) -> None:
    arm.reset_joints([0.1, 0.2])
    kept = sim.save_state("here")
    assert (kept.name, kept.robots) == ("here", 1) and [s.name for s in sim.saved_states()] == ["here"]
    arm.reset_joints([1.0, 1.0])
    sim.restore_state(kept)
    np.testing.assert_array_equal(arm.position, [0.1, 0.2])
    sim.delete_saved_state("here")
    with pytest.raises(simd_client.SavedStateNotFound) as refused:
        sim.restore_state("here")
    assert refused.value.metadata == {"saved_state": "here"}


def test_a_call_may_be_given_less_time_or_more(sim: Simulation) -> None:
    assert sim.with_timeout(3.0).timeout == 3.0 and sim.timeout == 10.0
    assert sim.with_timeout(3.0).step(3, timeout=5.0).stamp.step == 3


def test_any_method_of_the_schema_can_be_called(sim: Simulation) -> None:
    from simd_client import proto
    from simd_client.proto import methods

    answer = sim.call(methods.GetPhysics, proto.GetPhysicsRequest())
    assert answer.physics.time_step == 0.001
