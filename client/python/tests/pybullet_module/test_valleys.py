"""A ball in a valley that is a concave mesh or a height field: contacts, rays and shapes, field by field compared with PyBullet."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from .test_queries import flat

# Distance between PyBullet's rest position of a ball and exact contact, metres.
NEAR = 2e-3
# Same distance for the daemon, which tolerates less than a tenth of a millimetre of overlap.
OURS = 2e-4
# Tolerance of rays, metres: PyBullet's heights have single precision.
RAY = 1e-4
SLOPE = math.radians(30.0)
RADIUS, MASS, GRAVITY = 0.1, 1.0, 9.81
# Height of the lowest line of the valley, which lies along y.
PLACE = (0.3, -0.2, 0.4)
# Position of the ball along that line: in the middle of a cell of the height field, so that it touches no
# other triangle.
AHEAD = 0.25
SCALE = (1.0, 1.5, 1.0)


def file_of(folder: Path) -> Path:
    return folder / "valley.stl"


def of_mesh(p: Any, folder: Path) -> int:
    """The body of two large triangles, with a convex hull that would fill the valley."""
    corner = 2.0 * math.tan(SLOPE)
    records = b""
    left = [0.0, -2.0, 0.0, 0.0, 2.0, 0.0, -2.0, 0.0, corner]
    right = [0.0, 2.0, 0.0, 0.0, -2.0, 0.0, 2.0, 0.0, corner]
    for corners in (left, right):
        records += struct.pack("<12fH", 0.0, 0.0, 0.0, *corners, 0)
    file_of(folder).write_bytes(bytes(80) + struct.pack("<I", 2) + records)
    shape = p.createCollisionShape(
        p.GEOM_MESH, fileName=str(file_of(folder)), meshScale=list(SCALE), flags=p.GEOM_FORCE_CONCAVE_TRIMESH
    )
    made: int = p.createMultiBody(0, shape, -1, list(PLACE))
    return made


def of_heights(p: Any, folder: Path) -> int:
    """The same valley as five by five heights, half a metre apart."""
    del folder
    side = range(-2, 3)
    heights = [0.5 * abs(x) * math.tan(SLOPE) for _ in side for x in side]
    shape = p.createCollisionShape(
        p.GEOM_HEIGHTFIELD,
        meshScale=[0.5, 0.5, 1.0],
        heightfieldData=heights,
        numHeightfieldRows=5,
        numHeightfieldColumns=5,
    )
    # The middle of the heights is at the origin of the body.
    x, y, z = PLACE
    made: int = p.createMultiBody(0, shape, -1, [x, y, z + 0.5 * max(heights)])
    return made


Valley = Callable[[Any, Path], int]
each_valley = pytest.mark.parametrize("valley", [of_mesh, of_heights])


def resting_place() -> tuple[float, float, float]:
    """Height of the ball's middle, at contact with both sides."""
    x, y, z = PLACE
    return x, y + AHEAD, z + RADIUS / math.cos(SLOPE)


def fallen(p: Any, ground: int) -> tuple[int, list[Any]]:
    """A ball that fell from a centimetre above that, with each side's contact of the largest force."""
    x, y, z = resting_place()
    ball: int = p.createMultiBody(
        MASS, p.createCollisionShape(p.GEOM_SPHERE, radius=RADIUS), -1, [x, y, z + 0.01]
    )
    # Without friction only the two normal forces carry it.
    p.changeDynamics(ball, -1, lateralFriction=0.0)
    p.setGravity(0, 0, -GRAVITY)
    for _ in range(480):
        p.stepSimulation()
    points: list[Any] = list(p.getContactPoints(ball, ground))
    rows: list[Any] = []
    for side in (-1.0, 1.0):
        of_side = [point for point in points if point[7][0] * side > 0.0]
        assert of_side, points
        rows.append(sorted(of_side, key=lambda point: point[9])[-1])
    return ball, rows


@each_valley
def test_a_ball_in_a_valley_has_the_contacts_of_pybullet(
    bullet: Any, script: ModuleType, tmp_path: Path, valley: Valley
) -> None:
    middle = resting_place()
    # m g = 2 N cos a.
    force = MASS * GRAVITY / (2.0 * math.cos(SLOPE))
    for p, near, share in ((script, OURS, 0.01), (bullet, NEAR, 0.05)):
        ground = valley(p, tmp_path)
        ball, rows = fallen(p, ground)
        assert list(p.getBasePositionAndOrientation(ball)[0]) == pytest.approx(middle, abs=near)
        for side, row in zip((-1.0, 1.0), rows, strict=True):
            assert len(row) == 14
            assert row[:5] == (0, ball, ground, -1, -1)
            # From the ground to the ball, across the slope; the points of both are at the contact.
            normal = (side * math.sin(SLOPE), 0.0, math.cos(SLOPE))
            touched = [at - RADIUS * part for at, part in zip(middle, normal, strict=True)]
            assert list(row[5]) == pytest.approx(touched, abs=near)
            assert list(row[6]) == pytest.approx(touched, abs=near)
            assert list(row[7]) == pytest.approx(normal, abs=1e-3)
            assert row[8] == pytest.approx(0.0, abs=near)
            # The distance along the normal leads from the ground's point to the ball's.
            across = [b + row[8] * part - a for a, b, part in zip(row[5], row[6], row[7], strict=True)]
            assert across == pytest.approx([0.0, 0.0, 0.0], abs=1e-4)
            assert row[9] == pytest.approx(force, rel=share)
            # Friction is zero. Each chooses its two directions: the daemon has all of it along the first.
            assert (row[10], row[12]) == pytest.approx((0.0, 0.0), abs=1e-6)


@each_valley
def test_rays_onto_a_valley_hit_what_they_hit_in_pybullet(
    bullet: Any, script: ModuleType, tmp_path: Path, valley: Valley
) -> None:
    x, y, z = PLACE
    # Outside of all edges of triangles, regardless of the division of cells.
    down = [(a, b) for a in (-0.65, -0.35, 0.15, 0.65) for b in (-0.3, 0.1)]
    ways = [([x + a, y + b, z + 2.0], [x + a, y + b, z - 2.0]) for a, b in down]
    # Across the valley, above it, and beside it.
    ways.append(([x - 0.9, y + 0.2, z + 1.0], [x + 0.3, y + 0.1, z - 1.0]))
    ways.append(([x, y + 0.2, z + 2.0], [x, y + 0.2, z + 1.0]))
    ways.append(([x + 5.0, y, z + 2.0], [x + 5.0, y, z - 2.0]))
    if valley is of_mesh:
        # Its lower side is hit too, and the normal points to the ray's start.
        ways.append(([x + 0.15, y + 0.1, z - 2.0], [x + 0.15, y + 0.1, z + 2.0]))
    starts, ends = ([way[i] for way in ways] for i in (0, 1))
    found: list[Any] = []
    for p in (script, bullet):
        valley(p, tmp_path)
        rows = p.rayTestBatch(starts, ends)
        for way, row in zip(ways, rows, strict=True):
            (one,) = p.rayTest(*way)
            assert list(flat(one)) == pytest.approx(list(flat(row)), abs=1e-9)
        found.append(rows)
    for ours, theirs in zip(*found, strict=True):
        assert ours[:2] == theirs[:2]
        assert ours[2] == pytest.approx(theirs[2], abs=RAY)
        assert list(ours[3]) == pytest.approx(list(theirs[3]), abs=RAY)
        assert list(ours[4]) == pytest.approx(list(theirs[4]), abs=1e-3)
    for (a, b), ours in zip(down, found[0], strict=False):
        height = abs(a) * math.tan(SLOPE)
        assert list(ours[3]) == pytest.approx([x + a, y + b, z + height], abs=1e-6)
    assert [row[0] for row in found[0][len(down) : len(down) + 3]] == [0, -1, -1]


def test_a_concave_mesh_is_reported_as_pybullet_does(bullet: Any, script: ModuleType, tmp_path: Path) -> None:
    found: list[Any] = []
    for p in (script, bullet):
        ground = of_mesh(p, tmp_path)
        (touching,), (drawn,) = p.getCollisionShapeData(ground, -1), p.getVisualShapeData(ground)
        found.append((touching, drawn))
    (touching, drawn), (their_touching, their_drawn) = found
    assert touching[:3] == their_touching[:3] == (0, -1, script.GEOM_MESH)
    assert list(flat(touching[5:])) == pytest.approx(list(flat(their_touching[5:])), abs=1e-9)
    # A choice: PyBullet forgets scale and file, and reports (1, 1, 1) and b"unknown_file".
    assert touching[3:5] == (SCALE, str(file_of(tmp_path)).encode())
    assert [type(each) for each in drawn] == [type(each) for each in their_drawn]
    assert drawn[4] == their_drawn[4]
    assert list(flat((drawn[:4], drawn[5:]))) == pytest.approx(list(flat((their_drawn[:4], their_drawn[5:]))), abs=1e-6)


def test_a_height_field_is_reported_as_a_mesh(bullet: Any, script: ModuleType, tmp_path: Path) -> None:
    """Choices: PyBullet reports a height field as a visual of the kind GEOM_HEIGHTFIELD without a size, and
    no collision shape. The daemon reports a mesh in both cases, with its lengths."""
    found: list[Any] = []
    for p in (bullet, script):
        ground = of_heights(p, tmp_path)
        (drawn,) = p.getVisualShapeData(ground)
        found.append(drawn)
        if p is script:
            (touching,) = p.getCollisionShapeData(ground, -1)
            assert touching[:5] == (ground, -1, p.GEOM_MESH, (2.0, 2.0, 1.0), b"")
            assert list(flat(touching[5:])) == pytest.approx([0, 0, 0, 0, 0, 0, 1], abs=1e-9)
    theirs, ours = found
    assert ours[:2] == theirs[:2]
    assert ours[2:5] == (script.GEOM_MESH, (2.0, 2.0, 1.0), b"")
    # Pose and colour.
    assert list(flat(ours[5:])) == pytest.approx(list(flat(theirs[5:])), abs=1e-6)
