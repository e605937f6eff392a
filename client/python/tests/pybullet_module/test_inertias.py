"""Masses and inertias of loaded robots, compared with PyBullet, which computes the inertias of most files from their
shapes."""

from __future__ import annotations

import struct
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

CORNER = "v 0 0 0\nv 0.4 0 0\nv 0 0.6 0\nv 0 0 0.8\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
# The same: lines continue in the next ones, and tabs separate words.
FOLDED = CORNER.replace("v 0 0 0\n", "v\t0 \\\n 0 0\n").replace("v 0 0.6 0", "v 0 0.6 \\\n 0")
CORNERS = ((0.0, 0.0, 0.0), (0.4, 0.0, 0.0), (0.0, 0.6, 0.0), (0.0, 0.0, 0.8))
FACES = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))
INERTIAL = (
    "<inertial><origin xyz='{at}' rpy='{turn}'/><mass value='{mass}'/>"
    "<inertia ixx='0.3' iyy='0.4' izz='0.5' ixy='0' ixz='0' iyz='0'/></inertial>"
)
SHAPES = {
    "box": "<box size='0.2 0.4 0.6'/>",
    "ball": "<sphere radius='0.3'/>",
    "cylinder": "<cylinder radius='0.2' length='0.5'/>",
    "capsule": "<capsule radius='0.1' length='0.5'/>",
    "obj": "<mesh filename='corner.obj' scale='1 2 -1'/>",
    "stl": "<mesh filename='corner.stl'/>",
    "folded": "<mesh filename='folded.obj'/>",
}


def collision(shape: str, at: str = "0 0 0", turn: str = "0 0 0") -> str:
    return f"<collision><origin xyz='{at}' rpy='{turn}'/><geometry>{SHAPES[shape]}</geometry></collision>"


def inertial(mass: float, at: str = "0 0 0", turn: str = "0 0 0") -> str:
    return INERTIAL.format(mass=mass, at=at, turn=turn)


LINKS = {
    "root": inertial(3, "0.1 0 0") + collision("box"),
    **{f"{shape} alone": inertial(0.5) + collision(shape) for shape in SHAPES},
    **{f"{shape} aside": inertial(2, "0 0.1 0", "0.1 0.2 0.3") + collision(shape, "0.1 0 0", "0.3 0 0.2") for shape in SHAPES},
    "several": inertial(1, "0 0 0.1") + "".join(collision(shape, "0 0 0.3") for shape in SHAPES),
    "scaled": "<contact><inertia_scaling value='3'/></contact>" + inertial(0.1) + collision("box"),
    "touches nothing": inertial(4),
    "has no mass": collision("ball"),
    "is a frame": "",
}


@pytest.fixture
def robot(tmp_path: Path) -> str:
    (tmp_path / "corner.obj").write_text(CORNER)
    (tmp_path / "folded.obj").write_text(FOLDED)
    triangles = b"".join(struct.pack("<12fH", 0, 0, 0, *(x for corner in face for x in CORNERS[corner]), 0) for face in FACES)
    (tmp_path / "corner.stl").write_bytes(bytes(80) + struct.pack("<I", len(FACES)) + triangles)
    links = "".join(f"<link name='{name}'>{parts}</link>" for name, parts in LINKS.items())
    joints = "".join(
        f"<joint name='to {name}' type='continuous'><parent link='root'/><child link='{name}'/><axis xyz='0 0 1'/></joint>"
        for name in LINKS
        if name != "root"
    )
    file = tmp_path / "robot.urdf"
    file.write_text(f"<robot name='robot'>{links}{joints}</robot>")
    return str(file)


def inertias(p: Any, body: int) -> list[float]:
    """Mass and diagonal of each link."""
    rows = [p.getDynamicsInfo(body, link) for link in range(-1, p.getNumJoints(body))]
    return [number for row in rows for number in (row[0], *row[2])]


@pytest.mark.parametrize("scale", [1.0, 2.5])
@pytest.mark.parametrize("flag", ["", "URDF_USE_IMPLICIT_CYLINDER", "URDF_USE_INERTIA_FROM_FILE"])
def test_a_link_weighs_and_turns_as_pybullets(bullet: Any, script: ModuleType, robot: str, flag: str, scale: float) -> None:
    found = [
        inertias(p, p.loadURDF(robot, flags=getattr(p, flag) if flag else 0, globalScaling=scale)) for p in (bullet, script)
    ]
    assert len(found[1]) == 4 * len(LINKS)
    assert found[1] == pytest.approx(found[0], rel=1e-5, abs=1e-9)


@pytest.mark.parametrize("flag", ["", "URDF_USE_IMPLICIT_CYLINDER", "URDF_USE_INERTIA_FROM_FILE"])
def test_another_mass_brings_the_inertia_of_the_shape_as_in_pybullet(
    bullet: Any, script: ModuleType, robot: str, flag: str
) -> None:
    found: list[list[float]] = []
    for p in (bullet, script):
        body = p.loadURDF(robot, flags=getattr(p, flag) if flag else 0, globalScaling=2.5)
        for link in range(-1, p.getNumJoints(body)):
            p.changeDynamics(body, link, mass=3.5 + link)
        found.append(inertias(p, body))
        p.changeDynamics(body, 0, mass=2, localInertiaDiagonal=[1, 2, 3])
        found[-1] += p.getDynamicsInfo(body, 0)[2]
    assert found[1] == pytest.approx(found[0], rel=1e-5, abs=1e-9)


def test_another_mass_of_what_is_made_of_shapes_brings_their_inertia_too(
    bullet: Any, script: ModuleType, robot: str
) -> None:
    corner = str(Path(robot).with_name("corner.obj"))
    found: list[list[float]] = []
    for p in (bullet, script):
        found.append([])
        aside = {"collisionFramePosition": [0.3, 0.1, 0.0]}
        shapes = [
            p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.2, 0.3]),
            p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.2, 0.3], **aside),
            p.createCollisionShape(p.GEOM_SPHERE, radius=0.2),
            p.createCollisionShape(p.GEOM_CYLINDER, radius=0.2, height=0.6),
            p.createCollisionShape(p.GEOM_CAPSULE, radius=0.2, height=0.6),
            p.createCollisionShape(p.GEOM_MESH, fileName=corner),
        ]
        for shape in shapes:
            body = p.createMultiBody(1, shape)
            # An inertia of no shape.
            p.changeDynamics(body, -1, localInertiaDiagonal=[1, 2, 2.5])
            p.changeDynamics(body, -1, mass=4)
            found[-1] += inertias(p, body)
    # Bullet's hulls and boxes of several shapes have a margin of 1 to 4 cm here.
    assert found[1] == pytest.approx(found[0], rel=0.15)
    # A single shape in the middle has none.
    assert found[1][:4] == pytest.approx(found[0][:4]) and found[1][8:16] == pytest.approx(found[0][8:16])


def test_a_pole_swings_as_pybullets(bullet: Any, script: ModuleType, tmp_path: Path) -> None:
    """The inertia of its file is a placeholder, a hundred times the shape's."""
    file = tmp_path / "pole.urdf"
    placeholder = inertial(0.1, "0 0 0.5").replace("0.3", "1").replace("0.4", "1")
    pole = placeholder + collision("box", "0 0 0.5")
    file.write_text(
        f"<robot name='pole'><link name='post'>{inertial(1)}</link><link name='pole'>{pole}</link><joint name='turns' "
        "type='continuous'><parent link='post'/><child link='pole'/><axis xyz='0 1 0'/></joint></robot>"
    )
    angles: list[list[float]] = []
    for p in (bullet, script):
        body = p.loadURDF(str(file), useFixedBase=1)
        p.setGravity(0, 0, -9.81)
        p.setJointMotorControl2(body, 0, p.VELOCITY_CONTROL, force=0)
        p.resetJointState(body, 0, 0.2)
        angles.append([])
        for _ in range(240):
            p.stepSimulation()
            angles[-1].append(p.getJointState(body, 0)[0])
    assert max(angles[0]) > 3.0
    assert angles[1] == pytest.approx(angles[0], abs=0.01)


def test_numbers_beyond_all_measure_are_reported_by_the_daemon(script: ModuleType, tmp_path: Path) -> None:
    file = tmp_path / "large.urdf"
    large = inertial(1) + "<collision><geometry><sphere radius='1e200'/></geometry></collision>"
    file.write_text(f"<robot name='large'><link name='a'>{large}</link></robot>")
    with pytest.raises(script.error, match="Cannot load URDF file."):
        script.loadURDF(str(file))


def test_faults_of_a_file_are_reported_with_its_lines(script: ModuleType, tmp_path: Path) -> None:
    file = tmp_path / "two.urdf"
    file.write_text("<robot name='two'>\n<!-- a\n comment\n -->\n<link name='a'/>\n<link name='a'/>\n</robot>")
    with pytest.raises(script.error, match=r"line 6"):
        script.loadURDF(str(file))
