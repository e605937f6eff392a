"""Models of SDF files, compared with PyBullet."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import Any, cast

import pytest

INERTIA = "<inertia><ixx>0.1</ixx><iyy>0.2</iyy><izz>0.3</izz><ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia>"


def inertial(mass: float, pose: str) -> str:
    return f"<inertial><pose>{pose}</pose><mass>{mass}</mass>{INERTIA}</inertial>"


ARM = f"""<sdf version='1.6'><world name='default'>
<model name='arm'><pose>1 2 3 0.1 0.2 0.3</pose>
  <link name='base'><pose>0 0 0 0 0 0</pose>{inertial(2, "0.1 0 0.2 0 0 0.4")}
    <collision name='c'><pose>0 0 0.1 0 0 0</pose><geometry><box><size>0.2 0.4 0.6</size></box></geometry></collision>
  </link>
  <link name='upper'><pose>0 0 0.5 0.3 0 0</pose>{inertial(1, "0 0 0.1 0 0 0")}
    <collision name='c'><geometry><mesh><uri>meshes/corner.obj</uri><scale>1 2 1</scale></mesh></geometry></collision>
  </link>
  <link name='tip'><pose>0.3 0 0.9 0 0.4 0</pose>{inertial(0.5, "0 0 0 0 0 0")}
    <visual name='v'><geometry><sphere><radius>0.1</radius></sphere></geometry>
      <material><diffuse>0.1 0.2 0.3 1</diffuse></material></visual>
  </link>
  <joint name='turns' type='revolute'><parent>base</parent><child>upper</child><axis><xyz>0 1 0</xyz>
    <limit><lower>-1</lower><upper>2</upper><effort>30</effort><velocity>4</velocity></limit>
    <dynamics><damping>0.5</damping><friction>0.1</friction></dynamics></axis></joint>
  <joint name='slides' type='prismatic'><parent>upper</parent><child>tip</child><axis><xyz>0 0 1</xyz>
    <limit><lower>0</lower><upper>0.2</upper><effort>9</effort><velocity>1</velocity></limit></axis></joint>
</model>
<model name='wall'><static>1</static><pose>0 0 5 0 0 0</pose>
  <link name='wall'>{inertial(1, "0 0 0 0 0 0")}
    <collision name='c'><geometry><box><size>1 1 0.1</size></box></geometry></collision></link>
</model>
</world></sdf>"""
CORNER = "v 0 0 0\nv 0.4 0 0\nv 0 0.6 0\nv 0 0 0.8\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


@pytest.fixture
def arm(tmp_path: Path) -> str:
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "corner.obj").write_text(CORNER)
    (tmp_path / "arm.sdf").write_text(ARM)
    return str(tmp_path / "arm.sdf")


def same(ours: Any, theirs: Any) -> bool:
    """Whether numbers are equal; a quaternion may have either sign."""
    if isinstance(theirs, tuple):
        pairs: list[tuple[Any, Any]] = list(zip(ours, cast("tuple[Any, ...]", theirs), strict=True))
        is_turn = len(pairs) == 4 and all(isinstance(each, float) for _, each in pairs)
        return all(same(a, b) for a, b in pairs) or (is_turn and all(same(-a, b) for a, b in pairs))
    return ours == (theirs if isinstance(theirs, bytes) else pytest.approx(theirs, abs=1e-5))


@pytest.mark.parametrize("scale", [1.0, 2.5])
def test_models_are_as_pybullet_loads_them(bullet: Any, script: ModuleType, arm: str, scale: float) -> None:
    found: list[list[Any]] = []
    for p in (bullet, script):
        assert p.loadSDF(arm, globalScaling=scale) == (0, 1)
        rows: list[Any] = [p.getBodyInfo(body) for body in (0, 1)]
        rows += [p.getBasePositionAndOrientation(body) for body in (0, 1)]
        rows += [p.getDynamicsInfo(body, -1)[0] for body in (0, 1)]
        rows += [p.getNumJoints(body) for body in (0, 1)]
        for joint in range(2):
            info = p.getJointInfo(0, joint)
            rows += [info, p.getDynamicsInfo(0, joint)[0]]
            p.resetJointState(0, joint, 0.1)
            state = p.getLinkState(0, joint)
            rows += [state[:2], state[4:6]]
        rows.append(p.getVisualShapeData(0)[-1][:4])
        rows.append(tuple(row[5:] for row in p.getCollisionShapeData(0, 0)))
        found.append(rows)
    for theirs, ours in zip(*found, strict=True):
        assert same(ours, theirs), (ours, theirs)


def test_spherical_joints_are_as_pybullet_loads_them(bullet: Any, script: ModuleType, tmp_path: Path) -> None:
    links = "".join(f"<link name='l{at}'><pose>{0.1 * at} 0 0 0 {0.2 * at} 0</pose>{inertial(1, '0 0 0.1 0 0 0')}</link>" for at in range(3))
    joints = "".join(
        f"<joint name='j{at}' type='spherical'><parent>l{at}</parent><child>l{at + 1}</child></joint>" for at in range(2)
    )
    (tmp_path / "chain.sdf").write_text(f"<sdf version='1.6'><world name='w'><model name='chain'>{links}{joints}</model></world></sdf>")
    turn = bullet.getQuaternionFromEuler([0.1, 0.5, -0.3])
    found: list[Any] = []
    for p in (bullet, script):
        assert p.loadSDF(str(tmp_path / "chain.sdf")) == (0,) and p.getNumJoints(0) == 2
        p.resetJointStateMultiDof(0, 0, turn)
        found.append([(p.getJointInfo(0, joint)[:3], p.getLinkState(0, joint, computeForwardKinematics=1)[4:6]) for joint in range(2)])
        assert [kind for (_, _, kind), _ in found[-1]] == [p.JOINT_SPHERICAL] * 2
    for (theirs, at), (ours, here) in zip(*found, strict=True):
        assert theirs == ours and same(here, at), (here, at)


def test_a_static_model_stays_and_another_falls(script: ModuleType, arm: str) -> None:
    script.setGravity(0, 0, -9.81)
    moving, still = script.loadSDF(arm, globalScaling=2.0)
    before = [script.getBasePositionAndOrientation(body) for body in (moving, still)]
    assert before[1][0] == (0.0, 0.0, 10.0)
    for _ in range(10):
        script.stepSimulation()
    assert script.getBasePositionAndOrientation(still) == before[1]
    assert script.getBasePositionAndOrientation(moving)[0][2] < before[0][0][2]


def test_other_files_than_sdf_are_refused(script: ModuleType, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "model.sdf"
    for text, said in (
        ("<robot/>", "has no element sdf"),
        ("<sdf/>", "has no model"),
        ("<sdf><model name='a'><pose>1 2</pose><link name='l'/></model></sdf>", "a pose has 6 numbers"),
    ):
        file.write_text(text)
        with pytest.raises(script.error, match=f"(?i)Cannot load SDF file. .*{said}"):
            script.loadSDF(str(file))
    file.write_text("<sdf><model name='a'><link name='l'/><link name='m'/></model></sdf>")
    with pytest.raises(NotImplementedError, match="has 2 links without a parent"):
        script.loadSDF(str(file))
    with pytest.raises(script.error, match="globalScaling must be above 0"):
        script.loadSDF(str(file), globalScaling=0)
    with pytest.raises(script.error, match="Cannot load SDF file. Not found"):
        script.loadSDF("lost.sdf")
    mesh = "<collision name='c'><geometry><mesh><uri>lost.obj</uri></mesh></geometry></collision>"
    file.write_text(f"<sdf><model name='a'><link name='l'>{mesh}</link></model></sdf>")
    assert script.loadSDF(str(file)) == (0,)
    assert "the mesh lost.obj is not found" in capsys.readouterr().err


def test_search_paths_are_those_of_all_connections(script: ModuleType, arm: str) -> None:
    """As in PyBullet, they belong to the process."""
    other = script.connect(script.DIRECT, options="--new")
    script.setAdditionalSearchPath(str(Path(arm).parent))
    assert script.loadSDF("arm.sdf", physicsClientId=other) == (0, 1)
    script.disconnect(other)
