"""Contact points, ray casts, friction and restitution."""

from __future__ import annotations

import numpy as np
import pytest
from daemon import ASSETS

import simd_client
from simd_client import PlacedShape, Pose, Robot, Shape, Simulation, Surface

WEIGHT = 2.0 * 9.81


@pytest.fixture
def floor(sim: Simulation) -> Robot:
    return sim.add_plane(name="floor")


@pytest.fixture
def box(sim: Simulation, floor: Robot) -> Robot:
    """A body of 2 kg that came to rest on the floor."""
    box = sim.add_box((0.2, 0.2, 0.2), 2.0, (0, 0, 0.1), name="crate")
    sim.step(500)
    return box


def test_the_floor_carries_what_lies_on_it(sim: Simulation, floor: Robot, box: Robot) -> None:
    contacts = box.contacts()
    assert len(contacts) >= 3
    for contact in contacts:
        assert {contact.robot_a, contact.robot_b} == {"floor", "crate"}
        assert contact.link_a == contact.link_b == "link"
        # The normal force pushes b.
        up = 1.0 if contact.robot_b == "crate" else -1.0
        np.testing.assert_allclose(contact.normal, [0, 0, up], atol=1e-6)
        assert contact.point[2] == pytest.approx(0.0, abs=2e-3)
        assert abs(contact.friction_force @ contact.normal) < 1e-6
    on_box = sum(c.force * (1 if c.robot_b == "crate" else -1) for c in contacts)
    np.testing.assert_allclose(on_box, [0, 0, WEIGHT], atol=0.01 * WEIGHT)
    assert len(sim.contacts()) == len(sim.contacts(floor)) == len(contacts)


def test_an_arm_in_the_air_touches_nothing(sim: Simulation) -> None:
    ball = sim.add_sphere(0.1, position=(0, 0, 5))
    sim.step(10)
    assert ball.contacts() == () and sim.contacts("sphere") == ()
    with pytest.raises(simd_client.RobotNotFound):
        sim.contacts("missing")


def test_rays_say_what_they_met_first(sim: Simulation, box: Robot) -> None:
    hits = sim.cast_rays([[0, 0, 2.2], [5, 0, 1], [5, 0, 1]], [[0, 0, -1.8], [5, 0, -1], [5, 0, 2]])
    assert hits.hit.tolist() == [True, True, False]
    assert hits.robots == ("crate", "floor", "") and hits.links == ("link", "link", "")
    np.testing.assert_allclose(hits.fractions, [0.5, 0.5, 1.0], atol=1e-3)
    np.testing.assert_allclose(hits.points, [[0, 0, 0.2], [5, 0, 0], [5, 0, 2]], atol=3e-3)
    np.testing.assert_allclose(hits.normals, [[0, 0, 1], [0, 0, 1], [0, 0, 0]], atol=1e-3)


def test_one_start_does_for_many_rays_and_thousands_are_asked_for_in_parts(
    sim: Simulation, floor: Robot
) -> None:
    ends = np.column_stack([np.linspace(-1, 1, 2500), np.zeros(2500), np.full(2500, -1.0)])
    hits = sim.cast_rays([0, 0, 1], ends)
    assert len(hits) == 2500 and hits.hit.all()
    np.testing.assert_allclose(hits.fractions, 0.5, atol=1e-6)
    assert len(sim.cast_rays([], [])) == 0
    with pytest.raises(ValueError, match="three numbers"):
        sim.cast_rays([0, 1], [1, 0])
    with pytest.raises(ValueError, match="2 starts and 3 ends"):
        sim.cast_rays(np.zeros((2, 3)), np.ones((3, 3)))


def test_a_slippery_box_slides_down_and_a_rough_one_stays(sim: Simulation) -> None:
    """On a slope of 0.3 rad, bodies with a friction above tan(0.3) = 0.309 stay. Others accelerate by g (sin
    0.3 - mu cos 0.3), and have moved a quarter of a half of it after half a second."""
    slope, sine, cosine = 0.3, np.sin(0.3), np.cos(0.3)
    sim.add_plane((sine, 0, cosine))
    turned = (0, np.sin(slope / 2), 0, np.cos(slope / 2))
    above = np.array([sine, 0.0, cosine]) * 0.05
    rough, smooth = (
        sim.add_box((0.1,) * 3, 1.0, above + [0, y, 0], turned, friction=friction)
        for y, friction in ((-1.0, 0.6), (1.0, 0.1))
    )
    before = rough.pose.position, smooth.pose.position
    sim.step(500)
    assert np.linalg.norm(rough.pose.position - before[0]) < 5e-3
    way = 9.81 * (sine - 0.1 * cosine) * 0.5**2 / 2
    assert np.linalg.norm(smooth.pose.position - before[1]) == pytest.approx(way, rel=0.05)


def test_surfaces_are_read_and_changed(sim: Simulation, arm: Robot, floor: Robot) -> None:
    ball = sim.add_sphere(0.1, 1.0, (0, 0, 1), friction=0.4, restitution=0.2)
    assert ball.surfaces() == {"link": Surface(0.4, 0.2, 1, 0xFFFFFFFF, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)}
    ball.set_surface(restitution=0.7)
    ball.set_surface(friction=0.3, link="link")
    assert ball.surfaces()["link"] == Surface(0.3, 0.7, 1, 0xFFFFFFFF, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    with pytest.raises(simd_client.LinkNotFound):
        ball.set_surface(friction=0.3, link="wheel")
    with pytest.raises(simd_client.InvalidValue):
        ball.set_surface(friction=-1.0)
    assert ball.surfaces()["link"] == Surface(0.3, 0.7, 1, 0xFFFFFFFF, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert set(arm.surfaces()) == set(arm.links)


def test_a_robot_is_loaded_with_other_surfaces_and_touches_itself_where_asked(sim: Simulation) -> None:
    two = """<robot name="two">
      <link name="a"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>
        </inertial><collision><geometry><sphere radius="0.2"/></geometry></collision></link>
      <link name="between"><inertial><mass value="1"/>
        <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <link name="b"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>
        </inertial><collision><geometry><sphere radius="0.2"/></geometry></collision></link>
      <joint name="one" type="continuous"><parent link="a"/><child link="between"/><axis xyz="1 0 0"/>
        </joint>
      <joint name="slide" type="prismatic"><parent link="between"/><child link="b"/><axis xyz="1 0 0"/>
        <origin xyz="0.5 0 0"/><limit lower="-1" upper="1" effort="100" velocity="10"/></joint>
    </robot>"""
    surfaces = {"": Surface(friction=0.2), "b": Surface(friction=0.9, restitution=0.5)}
    apart = sim.load_text(two, "apart", fixed=True, surfaces=surfaces)
    found = apart.surfaces()
    assert found["a"].friction == 0.2 and found["b"] == Surface(0.9, 0.5, 1, 0xFFFFFFFF, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    touching = sim.load_text(two, "touching", fixed=True, position=(0, 5, 0), self_collision=True)
    for robot in (apart, touching):
        # 0.1 m lie between the two: an initial overlap would be ignored.
        robot.joints["slide"].set_position(-0.3)
    sim.step(1500)
    assert apart.joints["slide"].position == pytest.approx(-0.3, abs=1e-2)
    assert touching.joints["slide"].position == pytest.approx(-0.1, abs=1e-2)
    assert apart.contacts() == ()
    (contact, *_) = touching.contacts()
    assert {contact.link_a, contact.link_b} == {"a", "b"}


def test_primitives_have_the_mass_of_water_where_none_is_said(sim: Simulation) -> None:
    assert sim.add_box((1, 2, 0.5)).info().mass == pytest.approx(1000.0)
    assert sim.add_cylinder(0.5, 2.0, position=(5, 0, 0)).info().mass == pytest.approx(500 * np.pi)
    capsule = sim.add_capsule(0.5, 2.0, 3.0, (9, 0, 0), fixed=True, color=(1, 0, 0))
    assert capsule.info().mass == pytest.approx(3.0) and capsule.info().is_fixed
    assert capsule.scene().visuals[0].color.red == 1.0 and capsule.scene().visuals[0].color.alpha == 1.0
    assert sim.add_cone(0.5, 3.0, position=(13, 0, 0)).info().mass == pytest.approx(250 * np.pi)
    assert sim.add_sphere(0.1, position=(9, 9, 0)).name == "sphere"
    assert sim.add_sphere(0.1, position=(9, 12, 0)).name == "sphere_1"
    with pytest.raises(simd_client.RobotExists):
        sim.add_sphere(0.1, name="sphere")
    with pytest.raises(ValueError, match="above 0 kg"):
        sim.add_sphere(0.1, mass=0.0)


def test_a_body_of_several_shapes_stands_on_its_legs(sim: Simulation) -> None:
    """A table of a plate and four legs, 0.6 m high, with the plate's frame."""
    sim.add_plane()
    legs = [PlacedShape(Shape.cylinder(0.02, 0.56), Pose.of((x, y, -0.3), (0, 0, 0, 1))) for x in (-0.3, 0.3) for y in (-0.3, 0.3)]
    table = sim.add_compound([Shape.box((0.8, 0.8, 0.04)), *legs], position=(0, 0, 0.58))
    water = 1000.0 * (0.8 * 0.8 * 0.04 + 4 * np.pi * 0.02**2 * 0.56)
    assert table.name == "compound" and table.info().mass == pytest.approx(water)
    assert len(table.scene().colliders) == 5
    sim.step(1000)
    assert table.link_poses()[table.links[0]].position[2] == pytest.approx(0.58, abs=1e-4)
    assert len(sim.contacts()) >= 4
    with pytest.raises(simd_client.InvalidValue, match="1 to 1000"):
        sim.add_compound([])


def test_a_fixed_arm_at_rest_carries_its_links(sim: Simulation) -> None:
    arm = sim.load(ASSETS / "Two Link.v2", "arm", fixed=True)
    sim.step(2000, {arm: [0.0, 0.0]})
    reactions = arm.joint_reactions()
    assert tuple(reactions) == tuple(joint.name for joint in arm.layout.joints)
    poses = arm.link_poses()
    masses = {link.name: link.mass for link in arm.info().links}
    # A joint carries the weight of all bodies below it, in world axes.
    carried = 0.0
    for joint in reversed(arm.layout.joints):
        carried += masses[joint.child_link]
        world = poses[joint.child_link].matrix()[:3, :3] @ reactions[joint.name].force
        np.testing.assert_allclose(world, [0, 0, carried * 9.81], atol=0.01 * carried * 9.81)
    # About its axis a joint carries its actuator's effort, and its dry friction.
    for joint, effort in zip(arm.layout.moving, arm.effort):
        assert joint.axis is not None
        about = float(reactions[joint.name].torque @ joint.axis)
        assert about == pytest.approx(effort, abs=joint.friction + 1e-3)
        assert abs(about) > 0.1
    with pytest.raises(KeyError):
        reactions["wrist"]


def test_a_step_brings_what_touches(sim: Simulation, arm: Robot) -> None:
    floor = sim.add_plane(name="floor", position=(0, 0, -3))
    crate = sim.add_box((0.2, 0.2, 0.2), 1.0, (5, 0, -2.9), name="crate")
    states = sim.step(100, states=[arm, crate], contacts=True)
    assert len(states.contacts) == 4 and {each.robot_b for each in states.contacts} <= {"floor", "crate"}
    assert sum(each.normal_force for each in states.contacts) == pytest.approx(9.81, rel=1e-3)
    for one, other in zip(states.contacts, crate.contacts(), strict=True):
        np.testing.assert_array_equal(one.point, other.point)
    assert sim.step(1, states=arm, contacts=True).contacts == ()
    assert len(sim.step(1, contacts=True).contacts) == 4 and sim.step(1, states=floor).contacts == ()


def test_a_step_brings_where_the_links_are(sim: Simulation, arm: Robot) -> None:
    ball = sim.add_sphere(0.1, position=(5, 0, 2))
    states = sim.step(10, {arm: [0.3, 0.2]}, states=arm, link_states=True)
    assert set(states) == set(states.links) == {"arm"}
    there, then = states.links["arm"], arm.link_states()
    np.testing.assert_array_equal(there.poses, then.poses)
    np.testing.assert_array_equal(there.twists, then.twists)
    assert there.stamp.step == 10
    both = sim.step(5, link_states=True)
    assert set(both.links) == {"arm", ball.name} and len(both) == 2
    assert both.links[ball.name].twists[0, 2] == pytest.approx(-9.81 * 0.015)
    assert sim.step(1, states=True).links == {}
