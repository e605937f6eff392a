"""Bodies of MJCF files."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

TREE = """<mujoco model='two'><compiler angle='radian'/>
<include file='parts/leg.xml'/>
<equality><weld body1='held'/></equality>
<worldbody>
  <body name='top' pos='0 0 1'><joint name='turn' axis='0 1 0' range='-1 1'/><geom type='box' size='0.1 0.2 0.3' mass='2'/>
    <body name='low' pos='0 0 -0.5'><joint name='slide' type='slide' axis='0 0 1' range='0 0.2'/><geom size='0.1' mass='1'/></body>
  </body>
  <body name='held' pos='0 3 1'><freejoint/><geom size='0.1' mass='1'/></body>
</worldbody></mujoco>"""
LEG = """<mujocoinclude><worldbody><body name='leg' pos='2 0 1'><freejoint/><geom size='0.2' mass='3'/></body>
</worldbody></mujocoinclude>"""


@pytest.fixture
def file(tmp_path: Path) -> str:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "leg.xml").write_text(LEG)
    (tmp_path / "two.xml").write_text(TREE)
    return str(tmp_path / "two.xml")


def by_name(p: Any, numbers: tuple[int, ...]) -> dict[str, int]:
    return {p.getBodyInfo(number)[1].decode(): number for number in numbers}


def test_bodies_of_a_file_and_of_those_that_it_includes_are_there(script: ModuleType, file: str) -> None:
    numbers = script.loadMJCF(file)
    assert numbers == (0, 1, 2)
    robots = by_name(script, numbers)
    assert set(robots) == {"top", "leg", "held"}
    top = robots["top"]
    names = [script.getJointInfo(top, joint)[1] for joint in range(script.getNumJoints(top))]
    assert [name for name in names if name in (b"turn", b"slide")] == [b"turn", b"slide"]
    turn = names.index(b"turn")
    assert script.getJointInfo(top, turn)[8:10] == (-1.0, 1.0)
    assert script.getDynamicsInfo(top, turn)[0] == pytest.approx(2.0)
    assert script.getDynamicsInfo(robots["leg"], -1)[0] == pytest.approx(3.0)
    assert script.getBasePositionAndOrientation(robots["leg"])[0] == pytest.approx((2.0, 0.0, 1.0))


def test_a_weld_of_the_file_holds_and_what_is_free_falls(script: ModuleType, file: str) -> None:
    robots = by_name(script, script.loadMJCF(file))
    script.setGravity(0, 0, -9.81)
    for _ in range(60):
        script.stepSimulation()
    assert script.getBasePositionAndOrientation(robots["held"])[0][2] == pytest.approx(1.0, abs=1e-4)
    assert script.getBasePositionAndOrientation(robots["leg"])[0][2] < 0.8


def test_masses_and_joints_are_those_of_pybullet(bullet: Any, script: ModuleType, tmp_path: Path) -> None:
    """Masses of densities: PyBullet reads no masses of geoms."""
    alone = tmp_path / "alone.xml"
    alone.write_text(
        "<mujoco><compiler angle='radian'/><worldbody><body name='a' pos='0 0 1'><joint type='free'/><geom type='sphere' size='0.1'/>"
        "<body name='b' pos='0 0 -0.5'><joint name='turn' type='hinge' axis='0 1 0' range='-1 1' limited='true'/>"
        "<geom type='sphere' size='0.15'/></body></body></worldbody></mujoco>"
    )
    found: list[Any] = []
    for p in (bullet, script):
        numbers = p.loadMJCF(str(alone))
        body = numbers[0]
        masses = [p.getDynamicsInfo(body, link)[0] for link in range(-1, p.getNumJoints(body))]
        moving = [p.getJointInfo(body, joint) for joint in range(p.getNumJoints(body))]
        limits = [info[8:10] for info in moving if info[2] == p.JOINT_REVOLUTE]
        found.append((len(numbers), sorted(mass for mass in masses if mass > 0), limits, p.getBasePositionAndOrientation(body)[0]))
    theirs, ours = found
    assert ours[0] == theirs[0]
    assert ours[1] == pytest.approx(theirs[1])
    assert ours[2] == [pytest.approx(each) for each in theirs[2]]
    assert ours[3] == pytest.approx(theirs[3])


def test_a_floor_comes_before_what_stands_on_it_as_in_pybullet(bullet: Any, script: ModuleType, tmp_path: Path) -> None:
    walker = tmp_path / "walker.xml"
    walker.write_text(
        "<mujoco><worldbody><geom name='floor' type='plane' size='5 5 1'/><body name='torso' pos='0 0 1.4'><joint type='free'/>"
        "<geom type='sphere' size='0.1'/></body></worldbody></mujoco>"
    )
    found: list[Any] = []
    for p in (bullet, script):
        numbers = p.loadMJCF(str(walker))
        found.append((numbers, [round(p.getBasePositionAndOrientation(number)[0][2], 6) for number in numbers]))
    assert found[0] == found[1] == ((0, 1), [0.0, 1.4])


def test_other_files_than_mjcf_are_refused(script: ModuleType, tmp_path: Path) -> None:
    with pytest.raises(script.error, match="Cannot load MJCF file. Not found"):
        script.loadMJCF("lost.xml")
    broken = tmp_path / "broken.xml"
    broken.write_text("<mujoco><worldbody><body><geom/>")
    with pytest.raises(script.error, match="Cannot load MJCF file. "):
        script.loadMJCF(str(broken))
    itself = tmp_path / "itself.xml"
    itself.write_text("<mujoco><include file='itself.xml'/></mujoco>")
    with pytest.raises(script.error, match="included twice"):
        script.loadMJCF(str(itself))


def test_sites_have_no_number(script: ModuleType, file: str) -> None:
    path = Path(file)
    path.write_text(TREE.replace("<body name='low'", "<site name='a'/><body name='low'").replace("mass='1'/></body>\n  </body>", "mass='1'/><site name='b'/></body>\n  </body>"))
    robots = by_name(script, script.loadMJCF(file))
    numbers = range(script.getNumJoints(robots["top"]))
    joints = [script.getJointInfo(robots["top"], number) for number in numbers]
    assert [joint[12] for joint in joints] == [b"top", b"low"]
    assert [joint[16] for joint in joints] == [-1, 0]
    script.resetJointState(robots["top"], 1, 0.1)
    assert script.getJointState(robots["top"], 1)[0] == pytest.approx(0.1)
