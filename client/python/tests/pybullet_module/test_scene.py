"""Shapes of bodies, the boxes around them and meshes, compared with PyBullet."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from .conftest import SEVEN_ARM

# PyBullet's boxes are larger by its collision margins: millimetres for a hull, turned with it.
MARGIN = 0.007
OBJ = "v 0 0 0\nv 0.4 0 0\nv 0 0.6 0\nv 0 0 0.8\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def flat(value: Any) -> Iterable[Any]:
    """The numbers of nested sequences."""
    if isinstance(value, (tuple, list)):
        for each in value:  # pyright: ignore[reportUnknownVariableType]
            yield from flat(each)
    else:
        yield value


def bodies(p: Any, mesh: Path) -> list[int]:
    """One of each kind of shape, rotated, with separate frames."""
    turn = p.getQuaternionFromEuler([0.1, 0.2, 0.3])
    frame = {"collisionFramePosition": [0.5, 0.1, 0.0], "collisionFrameOrientation": turn}
    drawn = p.createVisualShape(
        p.GEOM_CAPSULE, radius=0.1, length=0.5, rgbaColor=[1, 0, 0, 0.5], visualFramePosition=[0, 0.3, 0]
    )
    shapes = [
        p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.2, 0.3], **frame),
        p.createCollisionShape(p.GEOM_SPHERE, radius=0.4, **frame),
        p.createCollisionShape(p.GEOM_CYLINDER, radius=0.2, height=0.5, **frame),
        p.createCollisionShape(p.GEOM_CAPSULE, radius=0.2, height=0.5, **frame),
        p.createCollisionShape(p.GEOM_MESH, fileName=str(mesh), meshScale=[1, 2, 3], **frame),
        p.createCollisionShapeArray(
            [p.GEOM_BOX, p.GEOM_SPHERE],
            radii=[0.0, 0.3],
            halfExtents=[[0.1, 0.2, 0.3], [0, 0, 0]],
            collisionFramePositions=[[0, 0, 0], [1, 0, 0]],
        ),
    ]
    made = [p.createMultiBody(1, shape, drawn, [1, 2, 3], turn) for shape in shapes]
    made.append(p.createMultiBody(2, shapes[0], -1, [5, 5, 5], turn, baseInertialFramePosition=[0, 0, 0.1]))
    return made


def test_colours_of_another_length_are_white_as_in_pybullet(bullet: Any, script: ModuleType) -> None:
    for p in (bullet, script):
        for color in ([1, 0, 0], [], [0.1, 0.2, 0.3, 0.4, 0.5]):
            body = p.createMultiBody(1, -1, p.createVisualShape(p.GEOM_SPHERE, radius=0.1, rgbaColor=color))
            assert p.getVisualShapeData(body)[0][7] == (1.0, 1.0, 1.0, 1.0)
            p.changeVisualShape(body, -1, rgbaColor=[0, 1, 0, 0.5])
            p.changeVisualShape(body, -1, rgbaColor=color, specularColor=color)
            assert p.getVisualShapeData(body)[0][7] == (1.0, 1.0, 1.0, 1.0)
        shape = p.createVisualShapeArray([p.GEOM_SPHERE], radii=[0.1], halfExtents=[[1, 1, 1]], rgbaColors=[[1, 0]])
        assert p.getVisualShapeData(p.createMultiBody(1, -1, shape))[0][7] == (1.0, 1.0, 1.0, 1.0)


def test_visual_shapes_are_reported_as_pybullet_does(bullet: Any, script: ModuleType, tmp_path: Path) -> None:
    mesh = tmp_path / "corner.obj"
    mesh.write_text(OBJ)
    drawn = {"fileName": str(mesh), "meshScale": [1, 2, 3], "rgbaColor": [0, 1, 0, 1]}
    rows: list[list[Any]] = []
    for p in (bullet, script):
        made = bodies(p, mesh)
        made.append(p.createMultiBody(1, -1, p.createVisualShape(p.GEOM_MESH, **drawn)))
        made.append(p.loadURDF(str(SEVEN_ARM), useFixedBase=1))
        rows.append([p.getVisualShapeData(body, flags=flags) for body in made for flags in (0, 1)])
        assert p.getVisualShapeData(99) == ()
    for theirs, ours in zip(*rows, strict=True):
        # Each arm of simd has a separate file, which PyBullet draws with a separate texture number.
        textures = len(theirs[0]) == 9
        for a, b in zip(theirs, ours, strict=True):
            assert [type(each) for each in a] == [type(each) for each in b]
            assert a[4] == b[4]
            assert list(flat((b[:4], b[5:8]))) == pytest.approx(list(flat((a[:4], a[5:8]))), abs=1e-6)
            assert (len(a) == 9) == textures


def test_collision_shapes_and_boxes_are_reported_as_pybullet_does(
    bullet: Any, script: ModuleType, tmp_path: Path
) -> None:
    mesh = tmp_path / "corner.obj"
    mesh.write_text(OBJ)
    found: list[list[Any]] = []
    for p in (bullet, script):
        rows: list[Any] = []
        for body in bodies(p, mesh):
            # PyBullet forgets the scale of a mesh, and reports only the body of the first shape.
            shown = p.getCollisionShapeData(body, -1)
            rows.append([(row[2], () if row[2] == p.GEOM_MESH else row[3], row[5:]) for row in shown])
            assert shown[0][:2] == (body, -1) and (p is bullet or all(row[:2] == (body, -1) for row in shown))
            rows.append(p.getDynamicsInfo(body, -1)[2])
        found.append(rows)
        for call in (
            lambda: p.getAABB(99),
            lambda: p.getAABB(0, 7),
            lambda: p.getCollisionShapeData(99, -1),
            lambda: p.getCollisionShapeData(0, 7),
        ):
            with pytest.raises(p.error):
                call()
        point = p.createMultiBody(1, basePosition=[1, 2, 3])
        assert p.getCollisionShapeData(point, -1) == () and p.getVisualShapeData(point) == ()
        assert p.getAABB(point) == ((1, 2, 3), (1, 2, 3))
    assert len(found[0]) == len(found[1]) > 13
    for theirs, ours in zip(*found, strict=True):
        assert list(flat(ours)) == pytest.approx(list(flat(theirs)), abs=MARGIN)


def test_the_box_around_a_link_that_touches_nothing_is_a_point(script: ModuleType, tmp_path: Path) -> None:
    lost = tmp_path / "lost.urdf"
    inertial = "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>"
    lost.write_text(f"<robot name='lost'><link name='base'>{inertial}</link></robot>")
    assert script.getAABB(script.loadURDF(str(lost), [1, 2, 3])) == ((1, 2, 3), (1, 2, 3))


def test_boxes_around_links_are_those_of_pybullet_or_within_them(
    bullet: Any, script: ModuleType, tmp_path: Path
) -> None:
    """PyBullet rotates the box that surrounds a cylinder, capsule or hull in its own axes. With a frame or
    several shapes it rotates the box around all of a link. The daemon's box surrounds the shapes
    themselves."""
    mesh = tmp_path / "corner.obj"
    mesh.write_text(OBJ)
    found: list[list[Any]] = []
    for p in (bullet, script):
        made = bodies(p, mesh)
        upright = [
            p.createCollisionShape(p.GEOM_CYLINDER, radius=0.2, height=0.5),
            p.createCollisionShape(p.GEOM_CAPSULE, radius=0.2, height=0.5),
            p.createCollisionShape(p.GEOM_MESH, fileName=str(mesh), meshScale=[1, 2, 3]),
        ]
        made += [p.createMultiBody(1, shape, -1, [1, 2, 3]) for shape in upright]
        arm = p.loadURDF(str(SEVEN_ARM), [0, 0, 7], useFixedBase=1)
        p.resetJointState(arm, 2, 0.6)
        rows = [p.getAABB(body) for body in made]
        rows += [p.getAABB(arm, link) for link in range(-1, p.getNumJoints(arm)) if p.getCollisionShapeData(arm, link)]
        found.append(rows)
    theirs, ours = (np.array(rows) for rows in found)
    assert theirs.shape == ours.shape and len(ours) > 14
    assert (ours[:, 0] >= theirs[:, 0] - MARGIN).all() and (ours[:, 1] <= theirs[:, 1] + MARGIN).all()
    # Upright shapes, without separate frames.
    assert ours[7:10] == pytest.approx(theirs[7:10], abs=MARGIN)
    sizes = [rows[:, 1] - rows[:, 0] for rows in (ours, theirs)]
    assert (sizes[0] > 0.25 * sizes[1]).all()


def test_bodies_that_meet_a_box_are_found(bullet: Any, script: ModuleType) -> None:
    for p in (bullet, script):
        sphere = p.createCollisionShape(p.GEOM_SPHERE, radius=0.5)
        near, far = (p.createMultiBody(1, sphere, -1, [x, 0, 0]) for x in (0, 5))
        assert p.getOverlappingObjects([0.4, -1, -1], [1, 1, 1]) == ((near, -1),)
        assert sorted(p.getOverlappingObjects([0.4, -1, -1], [9, 1, 1])) == [(near, -1), (far, -1)]
        assert p.getOverlappingObjects([1, -1, -1], [2, 1, 1]) is None
        p.resetBasePositionAndOrientation(near, [9, 0, 0], [0, 0, 0, 1])
        p.stepSimulation()
        assert p.getOverlappingObjects([8, -1, -1], [9, 1, 1]) == ((near, -1),)


def test_a_mesh_of_a_file_and_of_arrays_falls_onto_its_hull(bullet: Any, script: ModuleType, tmp_path: Path) -> None:
    """A pyramid on its base: its corners are at most 0.3 m above the ground when it lies."""
    corners = [[0.3, 0.3, 0], [-0.3, 0.3, 0], [-0.3, -0.3, 0], [0.3, -0.3, 0], [0, 0, 0.5]]
    faces = [0, 2, 1, 0, 3, 2, 0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4]
    lines = [f"v {x} {y} {z}" for x, y, z in corners]
    lines += [f"f {faces[i] + 1} {faces[i + 1] + 1} {faces[i + 2] + 1}" for i in range(0, len(faces), 3)]
    file = tmp_path / "pyramid.obj"
    file.write_text("\n".join(lines))
    heights: list[list[float]] = []
    for p in (bullet, script):
        p.setGravity(0, 0, -9.81)
        p.createMultiBody(0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[50, 50, 1]), -1, [0, 0, -1])
        p.setAdditionalSearchPath(str(tmp_path))
        made = [
            p.createMultiBody(1, p.createCollisionShape(p.GEOM_MESH, **mesh), -1, [3 * index, 0, 0.05])
            for index, mesh in enumerate([{"fileName": "pyramid.obj"}, {"vertices": corners}])
        ]
        for _ in range(240):
            p.stepSimulation()
        heights.append([p.getBasePositionAndOrientation(body)[0][2] for body in made])
    assert heights[1] == pytest.approx(heights[0], abs=0.003)


def test_a_concave_mesh_is_its_parts(script: ModuleType) -> None:
    """A ball falls into a trough of two planks, which their hull would fill."""
    script.setGravity(0, 0, -9.81)
    corners: list[list[float]] = []
    faces: list[int] = []
    for side in (-1.0, 1.0):
        first = len(corners)
        corners += [[x, side * y, z] for x in (-1.0, 1.0) for y, z in ((0.5, 0.0), (0.7, 0.0), (0.7, 1.0), (0.5, 1.0))]
        for a, b, c, d in ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)):
            quad = [first + each for each in (a, b, c, a, c, d)]
            faces += quad if side < 0 else quad[::-1]
    script.createMultiBody(0, script.createCollisionShape(script.GEOM_BOX, halfExtents=[5, 5, 1]), -1, [0, 0, -1])
    script.createMultiBody(0, script.createCollisionShape(script.GEOM_MESH, vertices=corners, indices=faces))
    ball = script.createMultiBody(1, script.createCollisionShape(script.GEOM_SPHERE, radius=0.2), -1, [0, 0, 2])
    for _ in range(480):
        script.stepSimulation()
    assert script.getBasePositionAndOrientation(ball)[0][2] == pytest.approx(0.2, abs=0.01)


def test_a_batch_of_bodies_is_made_by_one_call(bullet: Any, script: ModuleType) -> None:
    places = [[x, 0.0, 1.0] for x in range(40)]
    for p in (bullet, script):
        made = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1), batchPositions=places)
        assert len(made) == 40
        assert [list(p.getBasePositionAndOrientation(body)[0]) for body in made] == places


def test_meshes_that_cannot_be_are_refused(script: ModuleType, tmp_path: Path) -> None:
    for mesh, said in (
        ({}, "needs fileName or vertices"),
        ({"fileName": "lost.obj"}, "could not load the mesh"),
        ({"vertices": [[0, 0]]}, "a vertex has 3 numbers"),
        ({"vertices": [[0, 0, 0]], "indices": [0, 0, 1]}, "indices are of vertices"),
    ):
        with pytest.raises(script.error, match=said):
            script.createCollisionShape(script.GEOM_MESH, **mesh)
    (tmp_path / "mesh.ply").write_text("ply")
    with pytest.raises(script.error, match="is not one of .obj, .stl, .dae"):
        script.createCollisionShape(script.GEOM_MESH, fileName=str(tmp_path / "mesh.ply"))
    size = {"numHeightfieldRows": 3, "numHeightfieldColumns": 2}
    with pytest.raises(script.error, match="has 4 numbers"):
        script.createCollisionShape(script.GEOM_HEIGHTFIELD, heightfieldData=[0.0] * 4, **size)
    with pytest.raises(script.error, match="must be numbers"):
        script.createCollisionShape(script.GEOM_HEIGHTFIELD, heightfieldData=["a"] * 6, **size)


def test_a_ball_rests_on_a_height_field_where_its_arrays_say(script: ModuleType) -> None:
    """A slope along x of 5 by 4 samples, half a metre a cell, flat along y. As in PyBullet its middle height
    is at the origin. The ball starts above x = 0.5, with the height 0.1 * (0.5 / 0.5) above the origin."""
    rows, columns = 5, 4
    data = [0.1 * i for _ in range(columns) for i in range(rows)]
    ground = script.createCollisionShape(
        script.GEOM_HEIGHTFIELD,
        meshScale=[0.5, 0.5, 1.0],
        heightfieldData=data,
        numHeightfieldRows=rows,
        numHeightfieldColumns=columns,
    )
    script.createMultiBody(0.0, ground)
    ball = script.createMultiBody(
        1.0, script.createCollisionShape(script.GEOM_SPHERE, radius=0.05), basePosition=[0.5, 0.3, 0.2]
    )
    script.setGravity(0, 0, -10)
    lowest = 1.0
    for _ in range(40):
        script.stepSimulation()
        (x, _, z), _ = script.getBasePositionAndOrientation(ball)
        lowest = min(lowest, z - 0.2 * x)
    # Across the slope the ball's middle is r / cos above it: 0.051.
    assert 0.0505 < lowest < 0.0512


def test_a_body_of_parts_keeps_them_where_it_is_fixed_and_freed(script: ModuleType) -> None:
    """Two planks apart, beside each other: a ball falls between them, before and after."""
    corners: list[list[float]] = []
    faces: list[int] = []
    for side in (-0.7, 0.5):
        first = len(corners)
        corners += [[x, side + y, z] for x in (-1.0, 1.0) for y in (0.0, 0.2) for z in (0.0, 1.0)]
        for a, b, c, d in ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)):
            faces += [first + each for each in (a, b, c, a, c, d)]
    body = script.createMultiBody(0, script.createCollisionShape(script.GEOM_MESH, vertices=corners, indices=faces))
    script.changeDynamics(body, -1, mass=5)
    script.changeDynamics(body, -1, mass=0)
    script.setGravity(0, 0, -9.81)
    ball = script.createMultiBody(1, script.createCollisionShape(script.GEOM_SPHERE, radius=0.2), -1, [0, 0, 2])
    for _ in range(240):
        script.stepSimulation()
    assert script.getBasePositionAndOrientation(ball)[0][2] < 0.0


def test_colours_that_a_script_changes_are_reported_as_pybullet_does(
    bullet: Any, script: ModuleType, tmp_path: Path
) -> None:
    picture = tmp_path / "picture.png"
    # A picture of one white pixel.
    picture.write_bytes(
        bytes.fromhex(
            "89504e470d0a1a0a0000000d4948445200000001000000010802000000907753de"
            "0000000c49444154789c63f8ffff3f0005fe02fe0def46b80000000049454e44ae426082"
        )
    )
    found: list[list[Any]] = []
    for p in (bullet, script):
        both = p.createVisualShapeArray(
            [p.GEOM_BOX, p.GEOM_SPHERE],
            radii=[0, 0.3],
            halfExtents=[[0.1, 0.2, 0.3], [0, 0, 0]],
            rgbaColors=[[1, 0, 0, 1], [0, 1, 0, 1]],
        )
        body = p.createMultiBody(1, -1, both)
        arm = p.loadURDF(str(SEVEN_ARM), [0, 0, 5], useFixedBase=1)
        first, second = p.loadTexture(str(picture)), p.loadTexture(str(picture))
        assert second == first + 1
        p.changeVisualShape(arm, 2, rgbaColor=[0.1, 0.2, 0.3, 0.4])
        rows = [[(row[1], row[7]) for row in p.getVisualShapeData(arm)]]
        for more in (
            {"shapeIndex": 1, "rgbaColor": [0.5, 0.5, 0.5, 1]},
            {"textureUniqueId": first},
            {"textureUniqueId": -1, "specularColor": [1, 1, 1]},
            {"rgbaColor": [0, 0, 1, 1]},
        ):
            assert p.changeVisualShape(body, -1, **more) is None
            rows.append([row[7] for row in p.getVisualShapeData(body)])
        p.resetVisualShapeData(body, -1, rgbaColor=[1, 0, 1, 1])
        # Unknown links are ignored.
        p.changeVisualShape(99, -1, rgbaColor=[1, 0, 0, 1])
        p.changeVisualShape(body, 7, rgbaColor=[1, 0, 0, 1])
        p.changeTexture(first, [0] * 12, 2, 2)
        rows.append([row[7] for row in p.getVisualShapeData(body)])
        found.append(rows)
        with pytest.raises(p.error, match="Error loading texture"):
            p.loadTexture(str(tmp_path / "lost.png"))
    # Links of the arm in the description's own colours differ in the last digits of single precision.
    theirs, ours = (list(flat(rows)) for rows in found)
    assert ours == pytest.approx(theirs, abs=1e-6)
    with pytest.raises(script.error, match="must be numbers"):
        script.changeVisualShape(0, -1, rgbaColor=["red", 0, 0, 1])
    with pytest.raises(script.error, match="have 12 values, and not 3"):
        script.changeTexture(0, [0] * 3, 2, 2)
