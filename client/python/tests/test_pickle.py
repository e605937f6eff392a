"""Results of calls can be sent to another process."""

from __future__ import annotations

import itertools
import pickle

import numpy as np
import pytest

import simd_client
from simd_client import Robot, Simulation


def test_states_are_equal_after_a_pickle(sim: Simulation, arm: Robot) -> None:
    arm.reset_joints([0.1, 0.2])
    states = sim.step(1, states=arm, link_states=True)
    again = pickle.loads(pickle.dumps(states))
    assert again.stamp == states.stamp and list(again) == ["arm"]
    np.testing.assert_array_equal(again["arm"].position, states["arm"].position)
    np.testing.assert_array_equal(again.links["arm"].poses, states.links["arm"].poses)
    assert again["arm"]["elbow joint"].mode is states["arm"]["elbow joint"].mode
    one = pickle.loads(pickle.dumps(arm.states(["elbow joint"])))
    assert one["elbow joint"].position == states["arm"]["elbow joint"].position


def test_other_results_can_be_pickled(sim: Simulation, arm: Robot) -> None:
    sim.parameters.add_slider("gain", 0, 1, 0.5)
    answers = [sim.info(), sim.physics, sim.statistics, sim.parameters.all(), arm.layout, arm.info(), arm.report]
    assert [repr(pickle.loads(pickle.dumps(each))) for each in answers] == [repr(each) for each in answers]
    events = list(itertools.islice(sim.events(after=0), 3))
    assert [each.sequence for each in pickle.loads(pickle.dumps(events))] == [each.sequence for each in events]


def test_an_error_keeps_its_class_and_what_it_is_about(sim: Simulation) -> None:
    with pytest.raises(simd_client.RobotNotFound) as refused:
        sim.robot("leg")
    again = pickle.loads(pickle.dumps(refused.value))
    assert type(again) is simd_client.RobotNotFound and str(again) == str(refused.value)
    assert (again.reason, again.metadata) == ("ROBOT_NOT_FOUND", {"robot": "leg"})
