"""Sliders and buttons belong to the daemon: any client moves them, any client sees it."""

from __future__ import annotations

import time

import pytest
from daemon import Daemon, within

import simd_client
from simd_client import Button, JointBinding, JointMode, Robot, Simulation, Slider


def test_a_slider_is_put_up_moved_and_taken_down(sim: Simulation) -> None:
    parameters = sim.parameters
    added = parameters.add_slider("gain", 0.0, 2.0, 0.5)
    assert (added.name, added.minimum, added.maximum, added.value) == ("gain", 0.0, 2.0, 0.5)
    parameters["gain"] = 1.5
    assert parameters["gain"] == 1.5
    with pytest.raises(simd_client.InvalidValue):
        parameters["gain"] = 3.0
    assert "gain" in repr(parameters) and "0 to 2" in repr(parameters)
    del parameters["gain"]
    with pytest.raises(simd_client.ParameterNotFound) as refused:
        parameters["gain"]
    assert refused.value.metadata == {"parameter": "gain"}


def test_a_button_counts_its_presses(sim: Simulation) -> None:
    assert isinstance(sim.parameters.add_button("go"), Button)
    sim.parameters.press("go")
    assert isinstance(pressed := sim.parameters.press("go", 2), Button) and pressed.presses == 3
    assert sim.parameters["go"] == 3.0


def test_a_name_that_is_taken_is_refused_replaced_or_made_another(sim: Simulation) -> None:
    parameters = sim.parameters
    parameters.add_slider("gain", 0, 1, 0.5)
    with pytest.raises(simd_client.ParameterExists):
        parameters.add_slider("gain", 0, 1, 0.5)
    assert parameters.add_slider("gain", 0, 5, 4, if_taken="replace").value == 4
    assert parameters.add_slider("gain", 0, 1, 0.5, if_taken="rename").name == "gain_1"
    assert list(parameters.all()) == ["gain", "gain_1"]
    assert parameters.remove() == ("gain", "gain_1")


def test_another_client_moves_a_slider_and_a_loop_sees_it_without_asking(
    sim: Simulation, daemon: Daemon
) -> None:
    sim.parameters.add_slider("gain", 0, 1, 0.5)
    with sim.parameters.watch() as watch, simd_client.connect(daemon.endpoint) as other:
        assert watch.newest()["gain"] == 0.5
        other.parameters.set({"gain": 0.75})
        stop = within()
        while watch.newest()["gain"] != 0.75 and time.monotonic() < stop:
            pass
        listed = watch.newest()
        slider = listed.by_name["gain"]
        assert isinstance(slider, Slider) and slider.value == 0.75
        assert sim.parameters.next(listed.version, 0.05).version == listed.version
        other.parameters.remove("gain")
        assert "gain" not in watch.wait(20)


def test_a_slider_that_is_bound_to_a_joint_moves_it_also_when_its_program_has_ended(
    sim: Simulation, daemon: Daemon, arm: Robot
) -> None:
    with simd_client.connect(daemon.endpoint) as other:
        elbow = other.robot("arm").joints["elbow joint"]
        added = other.parameters.add_slider("elbow", -1.0, 1.0, 0.0, joint=elbow)
        assert added.joint == JointBinding("arm", "elbow joint")
        other.parameters.add_slider("swing", -1.0, 1.0, 0.0, joint=JointBinding("arm", "shoulder joint", "velocity"))
    sim.parameters.set({"elbow": 0.4, "swing": -0.2})
    state = arm.read()
    assert (state["elbow joint"].mode, state["elbow joint"].target) == (JointMode.POSITION, 0.4)
    assert (state["shoulder joint"].mode, state["shoulder joint"].target) == (JointMode.VELOCITY, -0.2)
    assert "velocity of arm/shoulder joint" in repr(sim.parameters)
    arm.delete()
    with pytest.raises(simd_client.RobotNotFound):
        sim.parameters["elbow"] = 0.1
    assert sim.parameters["elbow"] == 0.4
    with pytest.raises(simd_client.RobotNotFound):
        sim.parameters.add_slider("none", 0, 1, 0, joint=JointBinding("arm", "elbow joint"))
    with pytest.raises(ValueError, match="not 'hold'"):
        sim.parameters.add_slider("none", 0, 1, 0, joint=JointBinding("arm", "elbow joint", "hold"))  # pyright: ignore[reportArgumentType]


def test_a_parameter_is_a_number_wherever_it_is_looked_up(sim: Simulation) -> None:
    sim.parameters.add_slider("gain", 0, 1, 0.5)
    sim.parameters.add_button("go")
    sim.parameters.press("go")
    with sim.parameters.watch() as watch:
        for parameters in (sim.parameters, sim.parameters.all(), watch.newest()):
            assert [parameters["gain"], parameters["go"]] == [0.5, 1.0]
            with pytest.raises(simd_client.ParameterNotFound, match="^[^'].*none") as refused:
                parameters["none"]
            assert refused.value.metadata == {"parameter": "none"}
    assert sim.parameters.all().by_name["gain"] == sim.parameters.get("gain")
