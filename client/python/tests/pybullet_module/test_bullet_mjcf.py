"""MJCF files for Bullet's reader, compared with PyBullet: those of `pybullet_envs`."""

from __future__ import annotations

import re
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

pybullet_data: Any = pytest.importorskip("pybullet_data")

MJCF = Path(pybullet_data.getDataPath()) / "mjcf"
FILES = [
    *("ant", "half_cheetah", "hopper", "walker2d", "humanoid_symmetric", "humanoid_fixed", "swimmer", "reacher", "pusher"),
    *("striker", "thrower", "inverted_pendulum", "inverted_double_pendulum", "capsule_fromtoX", "cylinder_fromtoZ", "ground_plane"),
]
OWN = """<mujoco model='own'><compiler angle='radian' meshdir='parts/'/>
<default><geom contype='2' conaffinity='4' rgba='0.1 0.2 0.3 1'/><default class='soft'><geom friction='0.3 0.2 0.1' condim='6'/></default></default>
<asset><mesh name='corner' file='corner.obj'/></asset>
<worldbody>
  <geom name='floor' type='plane' size='5 5 1' pos='0 0 -1'/>
  <geom type='box' size='0.1 0.2 0.3' pos='3 0 0' quat='0.8 0 0.6 0'/>
  <body name='top' pos='1 2 3' quat='0.6 0 0.8 0' childclass='soft'>
    <inertial pos='0.1 0 0.2' mass='2' diaginertia='1 1 1'/>
    <geom type='mesh' mesh='corner'/>
    <geom type='sphere' size='0.1' pos='0 0 0.3'/>
    <body pos='0 0 1'>
      <joint type='hinge' axis='0 1 0' pos='0 0 -0.1' name='swings'/>
      <joint type='slide' axis='0 0 1' pos='0 0.2 0' range='-1 1' limited='true'/>
      <geom type='capsule' size='0.1 0.2' axisangle='1 0 0 0.5'/>
      <geom type='cylinder' size='0.1' fromto='0 0 0 0.3 0.2 0.1'/>
    </body>
  </body>
  <body><joint type='slide' axis='1 0 0' range='0.5 1' limited='true' name='cart'/><geom type='box' size='1 1 1' contype='1' conaffinity='1'/></body>
</worldbody></mujoco>"""
CORNER = "v 0 0 0\nv 0.4 0 0\nv 0 0.6 0\nv 0 0 0.8\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def turn(quaternion: Any) -> tuple[float, ...]:
    """Returns a quaternion with one of its two signs."""
    x, y, z, w = quaternion
    sign = -1.0 if next((each for each in (w, x, y, z) if abs(each) > 1e-4), 0.0) < 0.0 else 1.0
    return tuple(sign * each for each in (x, y, z, w))


def read(p: Any, file: Path, flags: int) -> tuple[list[Any], list[float]]:
    """Returns facts on all bodies of a file: names and kinds, and numbers."""
    words: list[Any] = []
    numbers: list[float] = []
    for body in p.loadMJCF(str(file), flags=flags):
        words += [body, *p.getBodyInfo(body), p.getNumJoints(body)]
        position, orientation = p.getBasePositionAndOrientation(body)
        numbers += [*position, *turn(orientation)]
        for link in range(-1, p.getNumJoints(body)):
            mass, friction, inertia, *frame = p.getDynamicsInfo(body, link)[:8]
            numbers += [mass, friction, *inertia, *frame[0], *turn(frame[1]), frame[2], *p.getDynamicsInfo(body, link)[6:8]]
            if link < 0:
                continue
            info = p.getJointInfo(body, link)
            # Bullet counts joints without names over all files.
            name = re.sub(rb"^joint(fix_)?\d+", b"joint", info[1])
            words += [name, *info[2:6], info[12], info[16]]
            length = sum(each * each for each in info[13]) ** 0.5 or 1.0
            numbers += [*info[6:12], *(each / length for each in info[13]), *info[14], *turn(info[15])]
            state = p.getLinkState(body, link)
            numbers += [*state[4], *turn(state[5])]
    return words, numbers


@pytest.mark.parametrize("file", FILES)
def test_a_file_of_pybullets_is_read_as_pybullet_reads_it(bullet: Any, script: ModuleType, file: str) -> None:
    theirs, ours = (read(p, MJCF / f"{file}.xml", 0) for p in (bullet, script))
    assert ours[0] == theirs[0]
    assert ours[1] == pytest.approx(theirs[1], abs=1e-5, rel=1e-4)


def test_all_that_bullet_reads_is_read_as_it_does(bullet: Any, script: ModuleType, tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "corner.obj").write_text(CORNER)
    (tmp_path / "own.xml").write_text(OWN)
    theirs, ours = (read(p, tmp_path / "own.xml", p.MJCF_COLORS_FROM_FILE) for p in (bullet, script))
    assert ours[0] == theirs[0]
    assert ours[1] == pytest.approx(theirs[1], abs=1e-5, rel=1e-4)
    assert script.getVisualShapeData(1)[0][7] == pytest.approx(bullet.getVisualShapeData(1)[0][7])


def test_an_ant_falls_onto_its_feet_as_pybullets(bullet: Any, script: ModuleType) -> None:
    heights: list[float] = []
    for p in (bullet, script):
        p.setGravity(0, 0, -9.8)
        p.loadMJCF(str(MJCF / "ground_plane.xml"))
        ant = p.loadMJCF(str(MJCF / "ant.xml"), flags=p.URDF_USE_SELF_COLLISION | p.URDF_USE_SELF_COLLISION_EXCLUDE_ALL_PARENTS)[0]
        for joint in range(p.getNumJoints(ant)):
            low, high = p.getJointInfo(ant, joint)[8:10]
            if low < high:
                p.resetJointState(ant, joint, (low + high) / 2.0)
        for _ in range(480):
            p.stepSimulation()
        heights.append(p.getBasePositionAndOrientation(ant)[0][2])
    assert 0.2 < heights[0] < 0.7
    assert heights[1] == pytest.approx(heights[0], abs=0.03)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("size='0.1'", "size='1e200'"), "out of range"),
        (("<body pos='0 0 1'>", "<body name='top'>"), "two bodies have the name top"),
        (("<body>", "<body>" * 3000), "recursion"),
    ],
)
def test_unreadable_parts_are_reported(script: ModuleType, tmp_path: Path, change: tuple[str, str], said: str) -> None:
    # The numbers of ends and beginnings match.
    ends = "</body>" * max(change[1].count("<body>"), 1)
    text = OWN.replace(*change).replace("</body>\n</worldbody>", f"{ends}</worldbody>")
    (tmp_path / "own.xml").write_text(text)
    with pytest.raises(script.error, match=f"Cannot load MJCF file. .*{said}"):
        script.loadMJCF(str(tmp_path / "own.xml"))
