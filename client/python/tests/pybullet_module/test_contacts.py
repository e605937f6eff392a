"""Contact points and ray casts."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import Any

import pytest


@pytest.fixture
def resting(script: ModuleType) -> "tuple[int, int]":
    """A floor, and a box of 2 kg that lies on it."""
    floor = script.createMultiBody(0.0, script.createCollisionShape(script.GEOM_PLANE))
    shape = script.createCollisionShape(script.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    box = script.createMultiBody(2.0, shape, -1, [0, 0, 0.1])
    script.setGravity(0, 0, -9.81)
    for _ in range(240):
        script.stepSimulation()
    return floor, box


def test_resting_bodies_are_carried(script: ModuleType, resting: "tuple[int, int]") -> None:
    floor, box = resting
    points: tuple[Any, ...] = script.getContactPoints(box, floor)
    assert len(points) >= 3
    # A is the box: the normal on the floor shows up to it.
    assert {point[1:5] for point in points} == {(box, floor, -1, -1)}
    for point in points:
        assert len(point) == 14
        assert point[7] == pytest.approx((0.0, 0.0, 1.0), abs=1e-3)
        assert point[5][2] == pytest.approx(0.0, abs=2e-3)
        assert point[6][2] - point[5][2] == pytest.approx(-point[8], abs=1e-9)
    assert sum(point[9] for point in points) == pytest.approx(2.0 * 9.81, rel=0.01)


def test_the_first_body_asked_for_is_a(script: ModuleType, resting: "tuple[int, int]") -> None:
    floor, box = resting
    swapped = script.getContactPoints(floor, box)
    assert {point[1:3] for point in swapped} == {(floor, box)}
    assert all(point[7] == pytest.approx((0.0, 0.0, -1.0), abs=1e-3) for point in swapped)
    assert len(script.getContactPoints()) == len(swapped)
    assert len(script.getContactPoints(box)) == len(swapped)
    assert script.getContactPoints(box, floor, linkIndexA=3) == ()
    assert script.getContactPoints(77) == ()


def test_rays_stop_at_what_they_hit(script: ModuleType, resting: "tuple[int, int]") -> None:
    floor, box = resting
    (hit,) = script.rayTest([0, 0, 2.2], [0, 0, -1.8])
    assert hit[:2] == (box, -1)
    assert hit[2] == pytest.approx(0.5, abs=1e-3)
    assert hit[3] == pytest.approx((0.0, 0.0, 0.2), abs=2e-3)
    assert hit[4] == pytest.approx((0.0, 0.0, 1.0), abs=1e-3)
    assert script.rayTest([5, 0, 2], [5, 0, 3]) == ((-1, -1, 1.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),)
    many = script.rayTestBatch(
        [[x * 0.01, 3, 1] for x in range(2500)], [[x * 0.01, 3, -1] for x in range(2500)]
    )
    assert len(many) == 2500
    assert {ray[0] for ray in many} == {floor}
    (beside,) = script.rayTestBatch([[0, 3, 1]], [[0, 3, -1]], parentObjectUniqueId=box)
    assert beside[0] == floor and beside[3][2] == pytest.approx(0.0, abs=1e-6)


def test_friction_and_restitution_are_changed(script: ModuleType, resting: "tuple[int, int]") -> None:
    _, box = resting
    # PyBullet's default.
    assert script.getDynamicsInfo(box, -1)[1] == 0.5
    script.changeDynamics(box, -1, lateralFriction=0.05, restitution=0.3)
    # A new mass loads the robot again.
    script.changeDynamics(box, -1, mass=3.0)
    info = script.getDynamicsInfo(box, -1)
    assert (info[0], info[1], info[5]) == (3.0, 0.05, 0.3)


def test_friction_of_a_description_stays(script: ModuleType, tmp_path: Path) -> None:
    file = tmp_path / "rough.urdf"
    file.write_text("""<robot name="rough"><link name="rough"><contact><lateral_friction value="0.8"/></contact>
      <inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
      <collision><geometry><sphere radius="0.1"/></geometry></collision></link></robot>""")
    assert script.getDynamicsInfo(script.loadURDF(str(file)), -1)[1] == 0.8


def test_links_touch_each_other_where_a_script_asks_for_it(script: ModuleType, tmp_path: Path) -> None:
    """Two balls at the ends of a chain, one pushed into the other."""
    inertia = '<mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    ball = '<collision><geometry><sphere radius="0.2"/></geometry></collision>'
    links = "".join(
        f'<link name="{name}"><inertial>{inertia}</inertial>{shape}</link>'
        for name, shape in (("a", ball), ("between", ""), ("b", ball))
    )
    joint = '<joint name="{0}-{1}" type="{2}"><parent link="{0}"/><child link="{1}"/><axis xyz="1 0 0"/>{3}</joint>'
    slide = '<origin xyz="0.5 0 0"/><limit lower="-1" upper="1" effort="100" velocity="10"/>'
    chain = (
        links
        + joint.format("a", "between", "continuous", "")
        + joint.format("between", "b", "prismatic", slide)
    )
    file = tmp_path / "chain.urdf"
    file.write_text(f'<robot name="chain">{chain}</robot>')
    apart = script.loadURDF(str(file), useFixedBase=1)
    touching = script.loadURDF(str(file), [0, 5, 0], useFixedBase=1, flags=script.URDF_USE_SELF_COLLISION)
    for body in (apart, touching):
        script.setJointMotorControl2(body, 1, script.POSITION_CONTROL, -0.3, force=50)
    for _ in range(240):
        script.stepSimulation()
    assert script.getJointState(apart, 1)[0] == pytest.approx(-0.3, abs=1e-2)
    assert script.getJointState(touching, 1)[0] == pytest.approx(-0.1, abs=1e-2)
    assert script.getContactPoints(apart) == ()
    (point, *_) = script.getContactPoints(touching, touching)
    assert {point[3], point[4]} == {-1, 1}


def slid_and_bounced(module: Any) -> "list[float]":
    """Returns velocities of boxes that slide down a slope, by their friction, and rebound heights of balls,
    by the ground's restitution."""
    shape = module.createCollisionShape(module.GEOM_BOX, halfExtents=[0.2, 0.2, 0.05])
    tilt = module.getQuaternionFromEuler([0, 0.6, 0])
    slope = module.createMultiBody(0, module.createCollisionShape(module.GEOM_BOX, halfExtents=[50, 10, 1]), -1, [0, 0, -10], tilt)
    boxes: list[int] = []
    for index, friction in enumerate((0.1, 0.5, 0.9)):
        _, rotation = module.multiplyTransforms([0, 0, 0], tilt, [0, 0, 0], [0, 0, 0, 1])
        at, _ = module.multiplyTransforms([0, 0, -10], rotation, [0, index - 1, 1.051], [0, 0, 0, 1])
        box = module.createMultiBody(1, shape, -1, at, tilt)
        module.changeDynamics(box, -1, lateralFriction=friction, linearDamping=0, angularDamping=0)
        boxes.append(box)
    module.changeDynamics(slope, -1, lateralFriction=0.5)
    balls: list[int] = []
    for index, restitution in enumerate((0.0, 0.6, 1.0)):
        ground = module.createMultiBody(0, module.createCollisionShape(module.GEOM_BOX, halfExtents=[1, 1, 0.5]), -1, [10 + 3 * index, 0, 19.5])
        module.changeDynamics(ground, -1, restitution=restitution)
        ball = module.createMultiBody(1, module.createCollisionShape(module.GEOM_SPHERE, radius=0.1), -1, [10 + 3 * index, 0, 21.1])
        module.changeDynamics(ball, -1, restitution=0.9, linearDamping=0, angularDamping=0)
        balls.append(ball)
    module.setGravity(0, 0, -9.81)
    module.setTimeStep(1 / 1000)
    tops = [0.0] * len(balls)
    for step in range(1000):
        module.stepSimulation()
        if step > 500:
            heights = (module.getBasePositionAndOrientation(ball)[0][2] - 20.1 for ball in balls)
            tops = [max(top, height) for top, height in zip(tops, heights)]
    speeds = [sum(x * x for x in module.getBaseVelocity(box)[0]) ** 0.5 for box in boxes]
    return [*speeds, *tops]


def test_frictions_and_restitutions_of_two_are_multiplied(script: ModuleType, bullet: Any) -> None:
    ours, theirs = slid_and_bounced(script), slid_and_bounced(bullet)
    assert ours[:3] == pytest.approx(theirs[:3], rel=0.01)
    # Each rebound loses a little.
    assert ours[3:] == pytest.approx(theirs[3:], abs=1e-4)
    assert ours[3:] == pytest.approx([0.0, 0.54**2, 0.9**2], abs=0.05)
    # The closed form: g (sin a - mu cos a) t with the product of both frictions.
    assert ours[:3] == pytest.approx([9.81 * (0.5646 - friction * 0.5 * 0.8253) for friction in (0.1, 0.5, 0.9)], rel=0.01)


def test_a_contact_with_stiffness_is_a_spring_as_in_pybullet(script: ModuleType, bullet: Any) -> None:
    depths = []
    for module in (script, bullet):
        floor = module.createMultiBody(0, module.createCollisionShape(module.GEOM_BOX, halfExtents=[1, 1, 1]), -1, [0, 0, -1])
        ball = module.createMultiBody(2, module.createCollisionShape(module.GEOM_SPHERE, radius=0.1), -1, [0, 0, 0.1])
        module.changeDynamics(floor, -1, contactStiffness=2000, contactDamping=100)
        assert module.getDynamicsInfo(floor, -1)[8:10] == (100, 2000)
        module.setGravity(0, 0, -9.81)
        for _ in range(480):
            module.stepSimulation()
        depths.append(0.1 - module.getBasePositionAndOrientation(ball)[0][2])
    # Hooke's law, from Bullet's slop on.
    assert depths[0] == pytest.approx(2 * 9.81 / 2000 + 1e-5, abs=1e-7)
    assert depths[0] == pytest.approx(depths[1], abs=1e-5)


def test_springs_beyond_what_can_be_are_as_stiff_as_can_be(script: ModuleType, resting: "tuple[int, int]") -> None:
    _, box = resting
    # Bullet's value for rigid, and a spring that a reload keeps; an invalid number changes nothing.
    script.changeDynamics(box, -1, contactStiffness=1e18, contactDamping=0.1)
    script.changeDynamics(box, -1, contactStiffness=3000, contactDamping=200)
    with pytest.raises(script.error):
        script.changeDynamics(box, -1, contactStiffness=float("nan"))
    assert script.getDynamicsInfo(box, -1)[8:10] == (200, 3000)
    script.changeDynamics(box, -1, mass=4.0)
    for _ in range(480):
        script.stepSimulation()
    # Hooke's law, of four corners, from Bullet's slop on.
    assert 0.1 - script.getBasePositionAndOrientation(box)[0][2] == pytest.approx(4 * 9.81 / (4 * 3000) + 1e-5, abs=1e-7)
    script.changeDynamics(box, -1, contactStiffness=-1, contactDamping=-1)
    for _ in range(480):
        script.stepSimulation()
    assert 0.1 - script.getBasePositionAndOrientation(box)[0][2] == pytest.approx(0.0, abs=1e-4)
