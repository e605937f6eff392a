"""Constraints."""

from __future__ import annotations

import numpy as np
import pytest
from daemon import ASSETS

import simd_client
from simd_client import ConstraintEnd, Pose, Simulation


def test_a_constraint_is_made_read_changed_and_deleted(sim: Simulation) -> None:
    sim.pause()
    for name, x in (("left", 0.0), ("right", 0.5)):
        sim.add_sphere(0.1, mass=1.0, name=name, position=(x, 0, 1))
    constraints = sim.constraints
    here = ConstraintEnd(pose=Pose.of((0, 0, 1)))
    first = constraints.create("weld", here, ConstraintEnd("left"))
    pair = constraints.create("weld", ConstraintEnd("left"), ConstraintEnd("right"), name="pair")
    assert (first, pair) == ("constraint_1", "pair")
    sim.step(500)
    one, two = constraints.list()
    assert one.force == pytest.approx([0, 0, 2 * 9.81], abs=1e-4)
    assert two.force == pytest.approx([0, 0, 9.81], abs=1e-4)
    assert (one.kind, one.parent.robot, one.child.robot) == ("weld", "", "left")
    assert one.max_force == np.inf and not one.saturated and one.position_error < 1e-6
    constraints.change("pair", max_force=1.0)
    sim.step()
    (seen,) = constraints.list("right")
    assert seen.max_force == 1.0 and seen.saturated
    with pytest.raises(simd_client.ConstraintExists):
        constraints.create("weld", ConstraintEnd("left"), ConstraintEnd("right"), name="pair")
    constraints.delete("pair")
    with pytest.raises(simd_client.ConstraintNotFound) as refused:
        constraints.delete("pair")
    assert refused.value.metadata == {"constraint": "pair"}
    with pytest.raises(simd_client.InvalidValue):
        constraints.create("hinge", here, ConstraintEnd("right"), axis=(0, 0, 0))
    rope = constraints.create("distance", here, ConstraintEnd("right"), rope=True)
    assert [each for each in constraints.list() if each.name == rope][0].length == pytest.approx(0.5)


def test_a_robot_is_attached_as_it_is_to_another_and_to_the_world(sim: Simulation) -> None:
    sim.pause()
    top = sim.add_sphere(0.1, mass=1.0, name="top", position=(0, 0, 2))
    sim.add_box((0.1, 0.1, 0.1), mass=2.0, name="low", position=(0.3, 0, 1.5))
    assert sim.attach(top) == "constraint_1"
    held = sim.attach("low", top, name="load")
    sim.step(300)
    assert top.pose.position == pytest.approx([0, 0, 2], abs=1e-6)
    assert sim.robot("low").pose.position == pytest.approx([0.3, 0, 1.5], abs=1e-5)
    assert sim.constraints.list("low")[0].force == pytest.approx([0, 0, 2 * 9.81], abs=1e-3)
    sim.constraints.delete(held)
    sim.step(300)
    assert sim.robot("low").pose.position[2] < 1.2 and top.pose.position[2] == pytest.approx(2, abs=1e-6)
    sim.attach("low", link="link", max_force=1.0, breaks=True)
    sim.step(2)
    assert [each.child.robot for each in sim.constraints.list()] == ["top"]
    with pytest.raises(simd_client.LinkNotFound):
        sim.attach("low", link="wing")


def test_a_gear_is_made_changed_and_deleted(sim: Simulation) -> None:
    sim.pause()
    bench_arm = ASSETS / "Bench_Arm-1.2 rev B"
    first = sim.load(bench_arm, "first", fixed=True)
    # Only the gear holds it.
    second = sim.load(bench_arm, "second", fixed=True, passive=True, position=(0, 2, 0))
    ends = (ConstraintEnd("first", joint="shoulder"), ConstraintEnd("second", joint="shoulder"))
    gear = sim.constraints.create("gear", *ends, ratio=-2.0, offset=0.0)
    first.joints["shoulder"].target = 0.2
    sim.step(3000)
    (made,) = sim.constraints.list()
    assert (made.kind, made.ratio, made.offset, made.child.joint) == ("gear", -2.0, 0.0, "shoulder")
    assert first.position[0] > 0.1
    assert second.position[0] == pytest.approx(-2 * first.position[0], abs=1e-6)
    # About the joint's axis.
    assert abs(made.torque[1]) > 0.1 and made.torque[[0, 2]] == pytest.approx([0, 0], abs=1e-9)

    sim.constraints.change(gear, ratio=1.5, offset=0.1)
    sim.step(3000)
    (changed,) = sim.constraints.list("second")
    assert (changed.ratio, changed.offset) == (1.5, 0.1)
    assert second.position[0] == pytest.approx(1.5 * first.position[0] + 0.1, abs=1e-6)
    with pytest.raises(simd_client.InvalidValue, match="length"):
        sim.constraints.change(gear, length=1.0)
    sim.constraints.change(gear, max_force=0.1)
    sim.step()
    (weak,) = sim.constraints.list()
    assert weak.saturated and weak.max_force == 0.1
    assert np.linalg.norm(weak.torque) == pytest.approx(0.1, abs=1e-6)

    held = second.position[0]
    sim.constraints.delete(gear)
    assert sim.constraints.list() == ()
    sim.step(300)
    assert second.position[0] > held + 0.1
