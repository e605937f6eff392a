"""Collision filtering compared with PyBullet: which bodies fall through others, and which links of one body
touch."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

_INERTIA = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
_BOX = '<collision><geometry><box size=".4 .4 .4"/></geometry></collision>'


def boxes(p: Any) -> tuple[int, int]:
    """A floor, and a box that lies on it."""
    p.resetSimulation()
    p.setGravity(0, 0, -9.81)
    slab = p.createCollisionShape(p.GEOM_BOX, halfExtents=[5, 5, 0.5])
    floor = p.createMultiBody(0, slab, -1, [0, 0, -0.5])
    cube = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    return floor, p.createMultiBody(1, cube, -1, [0, 0, 0.1])


def falls(p: Any, box: int) -> bool:
    """Whether it is below the floor's surface after a quarter of a second."""
    for _ in range(60):
        p.stepSimulation()
    return p.getBasePositionAndOrientation(box)[0][2] < 0.0


@pytest.mark.parametrize("groups", [(1, 1), (1, 2), (1, 3), (2, 1), (2, 2), (0, -1), (1, -1), (4, -1), (0, 0), (6, 1)])
def test_groups_of_a_box_let_it_fall_as_in_pybullet(script: Any, bullet: Any, groups: tuple[int, int]) -> None:
    fell: list[bool] = []
    for p in (script, bullet):
        _, box = boxes(p)
        assert p.setCollisionFilterGroupMask(box, -1, *groups) is None
        fell.append(falls(p, box))
    assert fell[0] == fell[1]


@pytest.mark.parametrize("groups", [(1, 1), (2, 4), (2, 1), (0, 0), (4, 4)])
def test_groups_of_the_floor_let_a_box_fall_as_in_pybullet(script: Any, bullet: Any, groups: tuple[int, int]) -> None:
    fell: list[bool] = []
    for p in (script, bullet):
        floor, box = boxes(p)
        p.setCollisionFilterGroupMask(floor, -1, *groups)
        p.setCollisionFilterGroupMask(box, -1, 8, 2)
        fell.append(falls(p, box))
    assert fell[0] == fell[1]


def test_pairs_win_over_groups_as_in_pybullet(script: Any, bullet: Any) -> None:
    seen: list[list[bool]] = []
    for p in (script, bullet):
        fell: list[bool] = []
        floor, box = boxes(p)
        p.setCollisionFilterPair(box, floor, -1, -1, 0)
        fell.append(falls(p, box))
        floor, box = boxes(p)
        p.setCollisionFilterGroupMask(box, -1, 0, 0)
        p.setCollisionFilterPair(floor, box, -1, -1, 1)
        fell.append(falls(p, box))
        p.setCollisionFilterPair(box, floor, -1, -1, 0)
        fell.append(falls(p, box))
        seen.append(fell)
    assert seen[0] == seen[1] == [True, False, True]


def test_unknown_bodies_are_ignored_as_in_pybullet(script: Any, bullet: Any) -> None:
    for p in (script, bullet):
        floor, box = boxes(p)
        assert p.setCollisionFilterPair(box, floor, 9, -1, 0) is None
        assert p.setCollisionFilterPair(99, box, -1, -1, 0) is None
        assert p.setCollisionFilterGroupMask(box, 9, 0, 0) is None
        assert p.setCollisionFilterGroupMask(99, -1, 0, 0) is None
        assert not falls(p, box)


def chain(folder: Path) -> str:
    """Four overlapping boxes, each on a hinge of its predecessor."""
    links = "".join(f'<link name="l{i}">{_INERTIA}{_BOX}</link>' for i in range(4))
    joints = "".join(
        f'<joint name="j{i}" type="continuous"><parent link="l{i}"/><child link="l{i + 1}"/>'
        '<axis xyz="0 1 0"/><origin xyz="0.1 0 0"/></joint>'
        for i in range(3)
    )
    file = folder / "chain.urdf"
    file.write_text(f'<robot name="chain">{links}{joints}</robot>')
    return str(file)


def overlapping(p: Any, body: int) -> list[tuple[int, int]]:
    """Returns pairs of overlapping links that may touch. PyBullet reports them by contacts, the daemon by its
    filter, since it ignores initial overlaps."""
    if p.__name__ == "pybullet":
        p.performCollisionDetection()
        touching = p.getContactPoints(body, body)
        return sorted({(min(c[3], c[4]), max(c[3], c[4])) for c in touching})
    from simd_client.pybullet.connections import connected
    from simd_client.proto import GetCollisionFilterRequest, PairCollision, methods

    world = connected(0)
    robot = world.bodies[body]
    answer = world.wire.call(methods.GetCollisionFilter, GetCollisionFilterRequest(robot=robot.robot))
    if not answer.self_collision:
        return []
    names = {robot.link_name(link): link for link in range(-1, len(robot.joints))}
    off = PairCollision.PAIR_COLLISION_DISABLED
    pairs = {(a, b): b - a > 1 for a in range(-1, 3) for b in range(a + 1, 3)}
    for pair in answer.pairs:
        a, b = sorted((names[pair.link], names[pair.other_link]))
        pairs[a, b] = pair.collision != off
    return sorted(pair for pair, on in pairs.items() if on)


@pytest.mark.parametrize("flags", [0, 8, 8 | 16, 8 | 32, 8 | 8192, 8 | 8192 | 32, 8 | 8192 | 16, 16, 32, 8192])
def test_flags_of_self_collision_let_the_same_links_touch(
    script: Any, bullet: Any, tmp_path: Path, flags: int
) -> None:
    file = chain(tmp_path)
    seen: list[list[list[tuple[int, int]]]] = []
    for p in (script, bullet):
        body = p.loadURDF(file, useFixedBase=1, flags=flags)
        answer = [overlapping(p, body)]
        for a, b, on in ((-1, 0, 1), (-1, 1, 0), (0, 2, 0), (0, 2, 1), (-1, 2, 1), (0, 1, 0)):
            p.setCollisionFilterPair(body, body, a, b, on)
            answer.append(overlapping(p, body))
        seen.append(answer)
    assert seen[0] == seen[1]


def made_chain(p: Any, flags: int) -> int:
    """The same four boxes, made of shapes."""
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.2, 0.2, 0.2])
    still = [[0, 0, 0, 1]] * 3
    body: int = p.createMultiBody(
        *(0, shape, -1, [0, 0, 3]),
        linkMasses=[1] * 3,
        linkCollisionShapeIndices=[shape] * 3,
        linkVisualShapeIndices=[-1] * 3,
        linkPositions=[[0.1, 0, 0]] * 3,
        linkOrientations=still,
        linkInertialFramePositions=[[0, 0, 0]] * 3,
        linkInertialFrameOrientations=still,
        linkParentIndices=[0, 1, 2],
        linkJointTypes=[p.JOINT_REVOLUTE] * 3,
        linkJointAxis=[[0, 1, 0]] * 3,
        flags=flags,
    )
    return body


@pytest.mark.parametrize("flags", [0, 8, 8 | 16, 8 | 32, 8 | 8192, 16])
def test_links_of_what_is_made_of_shapes_touch_as_flags_say(script: Any, bullet: Any, flags: int) -> None:
    seen: list[list[list[tuple[int, int]]]] = []
    for p in (script, bullet):
        body = made_chain(p, flags)
        answer = [overlapping(p, body)]
        p.setCollisionFilterPair(body, body, -1, 1, 0)
        answer.append(overlapping(p, body))
        seen.append(answer)
    assert seen[0] == seen[1]


def test_filters_stay_when_a_body_is_loaded_again(script: Any) -> None:
    floor, box = boxes(script)
    script.setCollisionFilterPair(box, floor, -1, -1, 0)
    # Both are spawned again: a base is fixed or free from its spawn on.
    script.changeDynamics(box, -1, mass=0)
    script.changeDynamics(box, -1, mass=2)
    assert falls(script, box)
    floor, box = boxes(script)
    script.setCollisionFilterGroupMask(box, -1, 0, 0)
    script.changeDynamics(box, -1, mass=2)
    assert falls(script, box)


def test_a_base_that_is_freed_or_fixed_by_its_mass_touches_as_in_pybullet(script: Any, bullet: Any, tmp_path: Path) -> None:
    file = tmp_path / "box.urdf"
    file.write_text(f'<robot name="box"><link name="box">{_INERTIA}{_BOX}</link></robot>')
    heights: list[list[float]] = []
    for p in (script, bullet):
        p.setGravity(0, 0, -10)
        upper = p.loadURDF(str(file), [0, 0, 3], useFixedBase=True)
        lower = p.loadURDF(str(file), useFixedBase=True)
        p.changeDynamics(upper, -1, mass=1)
        for _ in range(360):
            p.stepSimulation()
        rests = p.getBasePositionAndOrientation(upper)[0][2]
        p.changeDynamics(upper, -1, mass=0)
        p.changeDynamics(lower, -1, mass=1)
        for _ in range(24):
            p.stepSimulation()
        # Both are held, then the lower one falls alone.
        heights.append([rests, p.getBasePositionAndOrientation(upper)[0][2], p.getBasePositionAndOrientation(lower)[0][2]])
    assert heights[0] == pytest.approx(heights[1], abs=2e-2)
