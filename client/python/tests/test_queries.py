"""Contacts, and geometric queries."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from daemon import ASSETS

import simd_client
from simd_client import CollisionPair, Configuration, PlacedShape, Pose, QueryRobot, Robot, Shape, Simulation, Surface

UPRIGHT = (0, 0, 0, 1)


@pytest.fixture
def floor(sim: Simulation) -> Robot:
    return sim.add_plane(name="floor")


@pytest.fixture
def ball(sim: Simulation, floor: Robot) -> Robot:
    """A ball of 0.1 m, 1 m above the floor."""
    return sim.add_sphere(0.1, 1.0, (0, 0, 1), name="ball")


def test_a_pair_is_switched_off_and_left_to_its_groups_again(sim: Simulation, ball: Robot, floor: Robot) -> None:
    ball.set_state(Pose.of((0, 0, 0.1), UPRIGHT))
    ball.set_collision("link", "link", False, other=floor)
    assert ball.collision_filter().pairs == (CollisionPair("link", "link", False, "floor"),)
    assert floor.collision_filter().pairs == (CollisionPair("link", "link", False, "ball"),)
    sim.step(200)
    assert ball.pose.position[2] < 0.0
    ball.set_collision("link", "link", None, other="floor")
    assert ball.collision_filter().pairs == ()
    with pytest.raises(simd_client.LinkNotFound):
        ball.set_collision("lid", "link", False, other=floor)


def test_groups_are_set_and_read_with_the_surfaces(sim: Simulation, ball: Robot) -> None:
    ball.set_state(Pose.of((0, 0, 0.1), UPRIGHT))
    ball.set_collision_groups(0, 0)
    assert ball.surfaces()["link"].collision_group == 0
    sim.step(200)
    assert ball.pose.position[2] < 0.0
    crate = sim.add_box((1, 1, 1), 1.0, (5, 0, 5), name="crate")
    crate.set_collision_groups(mask=6, link="link")
    assert crate.surfaces()["link"] == Surface(1.0, 0.0, 1, 6, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def test_an_srdf_comes_with_the_robot(sim: Simulation, tmp_path: Path) -> None:
    srdf = tmp_path / "arm.srdf"
    srdf.write_text('<robot name="arm"><disable_collisions link1="link_1" link2="link_3"/></robot>')
    arm = sim.load(ASSETS / "seven_arm", "arm", fixed=True, self_collision=True, srdf=srdf)
    answer = arm.collision_filter()
    assert answer.self_collision and answer.pairs == (CollisionPair("link_1", "link_3", False),)
    arm.set_collision_filter(self_collision=False)
    assert not arm.collision_filter().self_collision


def test_links_are_measured_where_a_robot_is_and_would_be(sim: Simulation, ball: Robot, floor: Robot) -> None:
    (found,) = sim.closest_points(ball, "floor")
    assert found.distance == pytest.approx(0.9)
    np.testing.assert_allclose(found.point_a, [0, 0, 0.9], atol=1e-12)
    np.testing.assert_allclose(found.point_b, [0, 0, 0], atol=1e-12)
    np.testing.assert_allclose(found.normal, [0, 0, -1], atol=1e-12)
    assert sim.closest_points(ball, max_distance=0.5) == ()
    arm = sim.load(ASSETS / "seven_arm", "arm", fixed=True, position=(3, 0, 0))
    here = sim.closest_points(arm, ball, nearest_only=True)[0].distance
    bent = Configuration(positions=[0.5] * 7)
    there = sim.closest_points(QueryRobot(arm, configuration=bent), ball, nearest_only=True)[0].distance
    assert there != here
    arm.reset_joints([0.5] * 7)
    assert sim.closest_points(arm, ball, nearest_only=True)[0].distance == there
    assert len(sim.closest_points(QueryRobot("arm", "link_7"), ball)) == 1
    with pytest.raises(simd_client.RobotNotFound):
        sim.closest_points("missing")


def test_shapes_of_no_robot_are_measured(sim: Simulation, ball: Robot) -> None:
    """A ball of 0.2 m, 2 m beside the robot's of 0.1 m and 1 m above the floor."""
    lamp = PlacedShape(Shape.sphere(0.2), Pose.of((2, 0, 1), UPRIGHT))
    found = {pair.robot_b: pair for pair in sim.closest_points(lamp)}
    assert {name: pair.distance for name, pair in found.items()} == pytest.approx({"floor": 0.8, "ball": 1.7})
    assert (found["ball"].robot_a, found["ball"].link_a) == ("", "")
    np.testing.assert_allclose(found["ball"].normal, [-1, 0, 0], atol=1e-12)
    (pair,) = sim.closest_points(Shape.sphere(0.5), lamp)
    assert pair.distance == pytest.approx(5**0.5 - 0.7)
    assert sim.closest_points(ball, Shape.box((0.1, 0.1, 0.1)))[0].distance == pytest.approx(0.85)
    with pytest.raises(simd_client.InvalidValue):
        sim.closest_points(Shape.sphere(-1.0))


def test_shapes_of_no_robot_overlap_and_are_cast(sim: Simulation, ball: Robot) -> None:
    assert sim.overlaps(Shape.box((1, 1, 1)), Pose.of((0, 0, 1.05), UPRIGHT)) == (("ball", "link"),)
    assert sim.overlaps(Shape.capsule(0.1, 3.0)) == (("floor", "link"), ("ball", "link"))
    hit = sim.cast_shape(Shape.sphere(0.1), (0, 0, -2), Pose.of((0, 0, 2.2), UPRIGHT))
    assert hit.robots == ("ball",) and hit.fractions[0] == pytest.approx(0.5, abs=1e-6)
    hit = sim.cast_shape(Shape.cone(0.1, 0.2), (0, 0, -2), Pose.of((0, 0, 2.2), (1, 0, 0, 0)))
    assert hit.robots == ("ball",) and hit.fractions[0] == pytest.approx(0.5, abs=1e-6), "apex down"
    missed = sim.cast_shape(Shape.cylinder(0.1, 0.2), (0, 0, 2), Pose.of((5, 0, 2), UPRIGHT))
    assert not missed.hit[0]
    np.testing.assert_allclose(missed.points, [[5, 0, 4]])
    with pytest.raises(simd_client.InvalidValue):
        sim.overlaps(Shape.sphere(-1.0))


def test_bounds_and_masked_rays(sim: Simulation, ball: Robot, floor: Robot) -> None:
    (bounds,) = sim.link_bounds()
    assert (bounds.robot, bounds.link) == ("ball", "link")
    np.testing.assert_allclose([bounds.lower, bounds.upper], [[-0.1, -0.1, 0.9], [0.1, 0.1, 1.1]])
    ball.set_collision_groups(4)
    assert sim.cast_rays([0, 0, 3], [0, 0, -1], collision_mask=4).robots == ("ball",)
    assert sim.cast_rays([0, 0, 3], [0, 0, -1], collision_mask=1).robots == ("floor",)
    ends = np.zeros((25_000, 3))
    ends[:, 0] = np.linspace(-1, 1, len(ends))
    hits = sim.cast_rays([0, 0, 3], ends)
    assert len(hits) == 25_000 and hits.hit.all()
