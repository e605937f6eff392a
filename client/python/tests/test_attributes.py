"""Objects refuse unknown attributes, and suggest the intended one."""

from __future__ import annotations

from typing import Any

import pytest
from daemon import ASSETS

from simd_client import Robot, Simulation, aio


def refused(of: Any, name: str) -> str:
    """Returns the message after an assignment."""
    with pytest.raises(AttributeError) as found:
        setattr(of, name, 0.5)
    return str(found.value)


def test_misspelt_attributes_raise_with_a_suggestion(sim: Simulation, arm: Robot) -> None:
    elbow = arm.joints["elbow joint"]
    assert refused(elbow, "traget") == "`Joint` has no attribute `traget`; did you mean `target`?"
    assert refused(elbow, "position") == "`Joint.position` cannot be assigned; did you mean `set_position(...)`?"
    assert "did you mean `set_properties(damping=...)`" in refused(elbow, "damping")
    assert "did you mean `set_properties(limits=...)`" in refused(elbow, "limits")
    assert refused(arm, "positions") == "`Robot` has no attribute `positions`; did you mean `set_positions(...)`?"
    assert "did you mean `set_state(pose=...)`" in refused(arm, "pose")
    assert refused(sim, "gravity") == "`Simulation` has no attribute `gravity`; did you mean `set_physics(gravity=...)`?"
    assert "did you mean `set_physics(time_step=...)`" in refused(sim, "time_step")
    assert "keep your values in your own objects" in refused(sim, "colour_of_the_cat")
    assert elbow.target == 0.0 and sim.physics.time_step == 0.001


def test_settable_attributes_can_be_set(arm: Robot) -> None:
    arm.joints["elbow joint"].target = 0.5
    assert arm.joints["elbow joint"].target == 0.5


def test_no_object_of_the_world_takes_another_attribute(sim: Simulation, arm: Robot) -> None:
    state = arm.read()
    watched = (sim.events(), arm.watch(), sim.watch())
    for of in (arm.joints, sim.view, sim.sensors, arm.cameras, sim.parameters, sim.constraints, state, *watched):
        assert "has no attribute `speed`" in refused(of, "speed")
    for name in ("position", "stamp", "layout"):
        assert f"`RobotState.{name}` cannot be assigned" in refused(state, name)


def test_a_class_of_the_user_keeps_what_it_likes(arm: Robot) -> None:
    class Named(Robot):
        colour: str

    mine = Named(arm.connection, arm.info())
    mine.colour = "red"
    assert mine.colour == "red"


async def test_the_asyncio_client_says_what_is_awaited(daemon: Any) -> None:
    async with aio.connect(daemon.endpoint) as sim:
        arm = await sim.load(ASSETS / "Two Link.v2", "arm", fixed=True, allow_renaming=True)
        assert "did you mean `await set_target(...)`" in refused(arm.joints["elbow joint"], "target")
        assert "did you mean `await set_physics(gravity=...)`" in refused(sim, "gravity")
        await arm.delete()
