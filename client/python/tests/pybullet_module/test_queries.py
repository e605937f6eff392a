"""Distances and rays, field by field compared with PyBullet."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

# PyBullet's boxes and hulls have a margin of a millimetre, and its GJK ends within some 1e-5 m.
NEAR = 2e-3


def flat(value: Any) -> Iterator[float]:
    """The numbers of nested tuples."""
    parts: Any = value if hasattr(value, "__len__") else ()
    for each in parts:
        yield from flat(each)
    if not hasattr(value, "__len__"):
        yield float(value)


def bodies(p: Any) -> tuple[int, int, int, int]:
    """A ball, two boxes and the ground."""
    ball = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1)
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.2, 0.2, 0.2])
    return (
        p.createMultiBody(1, ball, -1, [0, 0.02, 1.03]),
        p.createMultiBody(1, box, -1, [0.5, 0, 1]),
        p.createMultiBody(1, box, -1, [0, 0.6, 1], p.getQuaternionFromEuler([0.3, 0.2, 0.1])),
        p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE)),
    )


def same(ours: Any, theirs: Any, points: float = NEAR) -> None:
    """Checks equal numbers of bodies and links, the rest within the margin, and points on surfaces within
    `points`."""
    assert len(ours) == len(theirs)
    for one, other in zip(ours, theirs, strict=True):
        assert len(one) == len(other) == 14
        assert one[:5] == other[:5]
        assert list(flat(one[5:7])) == pytest.approx(list(flat(other[5:7])), abs=points)
        assert list(flat(one[8:])) == pytest.approx(list(flat(other[8:])), abs=NEAR)
        assert list(one[7]) == pytest.approx(list(other[7]), abs=10 * points)


def test_closest_points_have_the_fields_of_pybullet(script: Any, bullet: Any) -> None:
    found: list[list[Any]] = []
    for p in (script, bullet):
        ball, box, other, ground = bodies(p)
        p.stepSimulation()
        rows = [
            p.getClosestPoints(ball, box, 1.0),
            p.getClosestPoints(box, ball, 1.0),
            p.getClosestPoints(ball, box, 0.1),
            p.getClosestPoints(ball, ground, 5.0),
            p.getClosestPoints(bodyA=ground, bodyB=ball, distance=5.0),
            p.getClosestPoints(ball, other, 5.0, -1, -1),
            p.getClosestPoints(ball, other, 5.0, 3, -1),
            p.getClosestPoints(ball, 99, 5.0),
            p.getClosestPoints(99, ball, 5.0),
        ]
        # One in the other.
        p.resetBasePositionAndOrientation(box, [0.25, 0.02, 1.03], [0, 0, 0, 1])
        rows.append(p.getClosestPoints(ball, box, 1.0))
        found.append(rows)
        # Two boxes: with parallel edges only the distance must equal PyBullet's, and the points may differ.
        (pair,) = p.getClosestPoints(box, other, 1.0)
        found[-1].append((tuple([*pair[:5], (0,) * 3, (0,) * 3, pair[7], pair[8], *pair[9:]]),))
    for ours, theirs in zip(*found, strict=True):
        same(ours, theirs)


def test_closest_points_of_links_come_in_the_order_of_pybullet(script: Any, bullet: Any, tmp_path: Path) -> None:
    inertia = '<mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    ball = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'
    links = "".join(f'<link name="l{i}"><inertial>{inertia}</inertial>{ball}</link>' for i in range(4))
    joints = "".join(
        f'<joint name="j{i}" type="continuous"><parent link="l{i}"/><child link="l{i + 1}"/>'
        '<axis xyz="0 1 0"/><origin xyz="0.3 0 0"/></joint>'
        for i in range(3)
    )
    file = tmp_path / "chain.urdf"
    file.write_text(f'<robot name="chain">{links}{joints}</robot>')
    found: list[list[Any]] = []
    for p in (script, bullet):
        chain = p.loadURDF(str(file), [0, 3, 0.2], useFixedBase=1)
        ball_number = bodies(p)[0]
        p.resetJointState(chain, 1, 0.5)
        p.stepSimulation()
        rows = [
            p.getClosestPoints(chain, ball_number, 10.0),
            p.getClosestPoints(ball_number, chain, 10.0),
            p.getClosestPoints(ball_number, chain, 10.0, linkIndexB=2),
            p.getClosestPoints(ball_number, chain, 10.0, -1, 1),
            p.getClosestPoints(chain, chain, 10.0, -1, 2),
            p.getClosestPoints(chain, chain, 0.5),
        ]
        # PyBullet also measures each link against itself.
        found.append([tuple(row for row in each if row[1:3] != (chain, chain) or row[3] != row[4]) for each in rows])
    # Bullet's GJK ends when the distance is known, and is less precise about the point on a ball.
    for ours, theirs in zip(*found, strict=True):
        same(ours, theirs, points=0.01)


def test_closest_points_of_shapes_of_no_body_have_the_fields_of_pybullet(
    script: Any, bullet: Any, tmp_path: Path
) -> None:
    found: list[list[Any]] = []
    for p in (script, bullet):
        ball, box, _, _ = bodies(p)
        p.stepSimulation()
        turn = p.getQuaternionFromEuler([0.3, 0.2, 0.1])
        marble = p.createCollisionShape(p.GEOM_SPHERE, radius=0.05, collisionFramePosition=[0.0, 0.0, 0.1])
        pill = p.createCollisionShape(p.GEOM_CAPSULE, radius=0.1, height=0.5)
        can = p.createCollisionShape(p.GEOM_CYLINDER, radius=0.1, height=0.5)
        pair = p.createCollisionShapeArray(
            [p.GEOM_SPHERE, p.GEOM_SPHERE], radii=[0.1, 0.1], collisionFramePositions=[[0, 0, 0], [-0.7, 0, 0]]
        )
        at = {"collisionShapePositionB": [2, 0.3, 1.2], "collisionShapeOrientationB": turn}
        rows = [
            p.getClosestPoints(ball, -1, 5.0, collisionShapeB=marble),
            p.getClosestPoints(ball, -1, 5.0, collisionShapeB=pill, **at),
            p.getClosestPoints(ball, -1, 5.0, -1, -1, collisionShapeB=can, **at),
            p.getClosestPoints(ball, -1, 0.5, collisionShapeB=can, **at),
            p.getClosestPoints(-1, ball, 5.0, collisionShapeA=pair, collisionShapePositionA=[2, 0.02, 1.03]),
            p.getClosestPoints(-1, -1, 5.0, -1, -1, marble, marble, [0, 0, 0], [1, 0, 0]),
            # Both of them: the body and the shape.
            p.getClosestPoints(box, ball, 9.0, collisionShapeB=marble, collisionShapePositionB=[3, 0, 1]),
            p.getClosestPoints(-1, ball, 5.0, collisionShapeA=77),
        ]
        found.append([tuple(sorted(each, key=lambda row: (*row[:5], row[8]))) for each in rows])
    assert [len(rows) for rows in found[0]] == [1, 1, 1, 0, 2, 1, 2, 0]
    for ours, theirs in zip(*found, strict=True):
        same(ours, theirs, points=0.01)
    mesh = tmp_path / "corner.obj"
    mesh.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    shape = script.createCollisionShape(script.GEOM_MESH, fileName=str(mesh))
    with pytest.raises(NotImplementedError, match="make one with createMultiBody"):
        script.getClosestPoints(ball, -1, 5.0, collisionShapeB=shape)


def grazing(p: Any, ball: int, boxes: tuple[int, ...], starts: Any) -> Any:
    """Returns the rays, straight down, that pass within NEAR of the rim of the ball, or of an edge of a box.
    There Bullet's margins decide the hit, and the choice between an edge's two normals is arbitrary."""
    at = np.asarray(starts)[:, :2]
    centre = np.asarray(p.getBasePositionAndOrientation(ball)[0])[:2]
    found = np.abs(np.linalg.norm(at - centre, axis=1) - 0.1) < NEAR
    corners = 0.2 * np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    for box in boxes:
        position, turn = p.getBasePositionAndOrientation(box)
        matrix = np.array(p.getMatrixFromQuaternion(turn)).reshape(3, 3)
        placed = (np.asarray(position) + corners @ matrix.T)[:, :2]
        for one, other in itertools.combinations(range(8), 2):
            if np.count_nonzero(corners[one] != corners[other]) != 1:
                continue
            way = placed[other] - placed[one]
            # Seen from above, a vertical edge is only a point.
            part = np.clip((at - placed[one]) @ way / max(float(way @ way), 1e-12), 0.0, 1.0)
            found |= np.linalg.norm(at - placed[one] - part[:, None] * way, axis=1) < NEAR
    return found


def columns(hits: Any) -> list[Any]:
    """Bodies and links, fractions, points and normals."""
    return [np.array([hit[:2] for hit in hits]), *(np.array([hit[field] for hit in hits]) for field in (2, 3, 4))]


def test_rays_by_the_ten_thousand_hit_what_they_hit_in_pybullet(script: Any, bullet: Any) -> None:
    side = range(100)
    starts = np.array([[x * 0.02 - 1.0, y * 0.02 - 1.0, 3.0] for x in side for y in side])
    ends = starts - [0.0, 0.0, 4.0]
    found: list[list[Any]] = []
    for p in (script, bullet):
        ball, box, other, ground = bodies(p)
        p.stepSimulation()
        found.append(columns(p.rayTestBatch(starts.tolist(), ends.tolist())))
        # Misses are equal in all fields.
        misses = p.rayTestBatch(starts[:500].tolist(), (starts[:500] - [0.0, 0.0, 1.0]).tolist())
        assert misses == ((-1, -1, 1.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),) * 500
    (who, fraction, point, normal), (their_who, their_fraction, their_point, their_normal) = found
    assert len(who) == len(their_who) == 10_000
    grazes = grazing(bullet, ball, (box, other), starts)
    kept = ~grazes
    assert np.count_nonzero(grazes) < 200
    assert (who[kept] == their_who[kept]).all()
    for body, least in ((ball, 60), (box, 350), (other, 500), (ground, 8_500)):
        assert np.count_nonzero(kept & (who[:, 0] == body)) > least, body
    # Bullet casts rays at convex shapes by an iteration that ends within a millimetre of the surface. At a
    # flat angle that is several along the ray; its plane is exact.
    way = ends - starts
    across = np.abs(np.sum(way * normal, axis=1) * (fraction - their_fraction))
    assert across[kept].max() < 1e-3
    on_ground = kept & (who[:, 0] == ground)
    assert across[on_ground].max() < 1e-9
    # The ray's end on a ball differs too, and a millimetre of 0.1 m turns its normal by 0.01. Sides are flat.
    on_ball = kept & (who[:, 0] == ball)
    assert np.abs(normal - their_normal)[on_ball].max() < 0.01
    assert np.abs(normal - their_normal)[kept & ~on_ball].max() < 1e-6
    # Points match the fractions, on both sides.
    assert np.abs(point - (starts + way * fraction[:, None])).max() < 1e-9
    assert np.abs(their_point - (starts + way * their_fraction[:, None])).max() < 1e-9
    assert np.abs(np.linalg.norm(normal, axis=1) - 1.0).max() < 1e-9


def test_rays_of_a_link_are_about_its_centre_of_mass_as_in_pybullet(script: Any, bullet: Any) -> None:
    found: list[list[Any]] = []
    for p in (script, bullet):
        wall = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 5, 5])
        p.createMultiBody(0, wall, -1, [3, 0, 0])
        ball = p.createCollisionShape(p.GEOM_SPHERE, radius=0.01)
        turn = p.getQuaternionFromEuler([0.1, 0.05, 0.1])
        body = p.createMultiBody(
            *(1, ball, -1, [0, 0, 1], turn, [0.3, -0.2, 0.1], turn),
            linkMasses=[1],
            linkCollisionShapeIndices=[ball],
            linkVisualShapeIndices=[-1],
            linkPositions=[[0, 0.5, 0]],
            linkOrientations=[turn],
            linkInertialFramePositions=[[0.1, 0.2, -0.3]],
            linkInertialFrameOrientations=[turn],
            linkParentIndices=[0],
            linkJointTypes=[p.JOINT_FIXED],
            linkJointAxis=[[0, 0, 1]],
        )
        ends = ([[0.4, 0, 0], [0.4, 0.1, 0.2]], [[9, 0, 0], [9, 0.1, 0.2]])
        found.append([p.rayTestBatch(*ends, parentObjectUniqueId=body, parentLinkIndex=link) for link in (-1, 0)])
    assert all(row[0] == 0 for rows in found[1] for row in rows)
    assert list(flat(found[0])) == pytest.approx(list(flat(found[1])), abs=1e-4)


def test_two_arrays_of_three_numbers_are_a_ray(script: Any, bullet: Any) -> None:
    for p in (script, bullet):
        ball, *_ = bodies(p)
        begin, end = np.array([0, 0.02, 3.0]), np.array([0, 0.02, -1.0])
        assert [row[0] for row in p.rayTestBatch(begin, end)] == [ball]
        assert [row[0] for row in p.rayTestBatch(np.array([begin, begin]), np.array([end, end]))] == [ball, ball]
        assert [row[0] for row in p.rayTestBatch([begin], [end])] == [ball]


def test_masks_of_rays_are_as_in_pybullet(script: Any, bullet: Any) -> None:
    found: list[list[int]] = []
    for p in (script, bullet):
        ball, *_ = bodies(p)
        p.setCollisionFilterGroupMask(ball, -1, 4, -1)
        p.stepSimulation()
        down = ([[0, 0.02, 3]], [[0, 0.02, -1]])
        masks = (-1, 1, 2, 4, 6, 8)
        found.append([p.rayTestBatch(*down, collisionFilterMask=mask)[0][0] for mask in masks])
        found[-1] += [p.rayTest(down[0][0], down[1][0], collisionFilterMask=mask)[0][0] for mask in masks]
    assert found[0] == found[1]
