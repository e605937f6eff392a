"""Files are found where PyBullet finds them, and a missing one is reported."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

CUBE = "\n".join(f"v {x} {y} {z}" for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (-0.1, 0.1)) + (
    "\nf 1 2 4\nf 1 4 3\nf 5 7 8\nf 5 8 6\nf 1 5 6\nf 1 6 2\nf 3 4 8\nf 3 8 7\nf 1 3 7\nf 1 7 5\nf 2 6 8\nf 2 8 4\n"
)
BOX = """<robot name="box"><link name="l"><inertial><mass value="1"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/>
</inertial><{element}><geometry><mesh filename="{mesh}"/></geometry></{element}></link></robot>"""

LAYOUTS = {
    "beside": ("m1", "cube.obj", "m1/cube.obj"),
    "from the working folder": ("URDF", "URDF/meshes/cube.obj", "URDF/meshes/cube.obj"),
    "one up": ("model", "../meshes/cube.obj", "meshes/cube.obj"),
    "two up": ("a/b", "../../cad/cube.obj", "cad/cube.obj"),
    "from a folder above": ("arm/description", "stl/cube.obj", "arm/stl/cube.obj"),
    "a folder called urdf": ("x/urdf", "../stl/cube.obj", "x/stl/cube.obj"),
    "a package that is not known": ("pkg/urdf", "package://arm/cube.obj", "pkg/arm/cube.obj"),
    "absolute": ("abs", "{top}/elsewhere/cube.obj", "elsewhere/cube.obj"),
    "data": ("in", "cube.obj", "data/cube.obj"),
}


def box(top: Path, folder: str, mesh: str, element: str = "collision") -> str:
    """Writes the description, and returns its path from there."""
    (top / folder).mkdir(parents=True, exist_ok=True)
    (top / folder / "box.urdf").write_text(BOX.format(mesh=mesh.format(top=top), element=element))
    return f"{folder}/box.urdf"


@pytest.mark.parametrize("layout", LAYOUTS)
def test_a_mesh_is_found_where_pybullet_finds_it(
    script: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, layout: str
) -> None:
    folder, mesh, at = LAYOUTS[layout]
    (tmp_path / at).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / at).write_text(CUBE)
    monkeypatch.chdir(tmp_path)
    body = script.loadURDF(box(tmp_path, folder, mesh))
    assert [shape[2] for shape in script.getCollisionShapeData(body, -1)] == [script.GEOM_MESH]


@pytest.mark.parametrize("element", ["collision", "visual"])
def test_a_file_whose_mesh_is_nowhere_is_refused_as_in_pybullet(script: ModuleType, tmp_path: Path, element: str) -> None:
    file = str(tmp_path / box(tmp_path, "m", "nowhere.obj", element))
    with pytest.raises(script.error, match=r"Cannot load URDF file. link l: no file for `nowhere.obj`: looked in"):
        script.loadURDF(file)
    assert script.getNumBodies() == 0


def test_a_file_is_found_in_folders_called_data(script: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "data").mkdir()
    (tmp_path / "m").mkdir()
    (tmp_path / "m" / "cube.obj").write_text(CUBE)
    (tmp_path / "data" / "box.urdf").write_text(BOX.format(mesh=tmp_path / "m" / "cube.obj", element="collision"))
    for folder in (tmp_path, tmp_path / "sub", tmp_path / "sub" / "deep"):
        folder.mkdir(exist_ok=True)
        monkeypatch.chdir(folder)
        assert script.loadURDF("box.urdf") >= 0


def test_a_name_that_begins_with_a_slash_is_found_below_the_working_folder_too(
    bullet: Any, script: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    inertial = "<inertial><mass value='2'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>"
    (tmp_path / "model").mkdir()
    (tmp_path / "model" / "rod.urdf").write_text(f"<robot name='rod'><link name='base'>{inertial}</link></robot>")
    monkeypatch.chdir(tmp_path)
    for p in (bullet, script):
        assert p.getDynamicsInfo(p.loadURDF("/model/rod.urdf"), -1)[0] == 2.0


def test_a_mesh_of_mjcf_that_is_nowhere_is_said(script: ModuleType, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "model.xml"
    file.write_text(
        '<mujoco><asset><mesh name="m" file="nowhere.stl"/></asset><worldbody><body name="a"><freejoint/><geom size="0.1" mass="1"/>'
        '<geom type="mesh" mesh="m" contype="0" conaffinity="0" mass="0.1"/></body></worldbody></mujoco>'
    )
    try:
        script.loadMJCF(str(file))
    except script.error as refusal:
        assert "nowhere.stl" in str(refusal)
    else:
        assert "no file for `nowhere.stl`" in capfd.readouterr().err
