"""Paths of assets lead to the same files as in the other clients."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest
from daemon import REPOSITORY

from simd_client.assets import Locator, Missing, Why, find_urdf
from simd_client.assets.package import RosPaths
from simd_client.errors import NoUrdf

VECTORS = REPOSITORY / "server" / "formats" / "assets" / "vectors" / "paths.json"


def make(tree: Path, case: dict[str, Any]) -> None:
    for path, content in case["files"].items():
        (tree / path).parent.mkdir(parents=True, exist_ok=True)
        (tree / path).write_text(content)
    for path, target in case.get("links", {}).items():
        (tree / path).parent.mkdir(parents=True, exist_ok=True)
        os.symlink(target.replace("{tree}", str(tree)), tree / path)


def test_each_shared_vector_is_answered_as_it_says(tmp_path: Path) -> None:
    if not VECTORS.is_file():
        pytest.skip("this tree has no shared vectors")
    asked = 0
    for number, case in enumerate(json.loads(VECTORS.read_text())):
        # The limits of a daemon's asset root do not apply to clients.
        if "root" in case:
            continue
        tree = (tmp_path / str(number)).resolve()
        tree.mkdir()
        make(tree, case)
        folders = {
            key: [tree / name for name in case.get(key, [])]
            for key in ("ros_package_path", "ament_prefix_path")
        }
        packages = {name: tree / folder for name, folder in case.get("packages", {}).items()}
        ros = RosPaths(folders["ros_package_path"], folders["ament_prefix_path"])
        locator = Locator(tree / case["urdf"], packages, ros)
        for question in case["find"]:
            expected = tree / question["path"] if "path" in question else Why(question["why"])
            assert found(locator, question["uri"].replace("{tree}", str(tree))) == expected, (
                case["name"],
                question,
            )
            asked += 1
    assert asked > 80


def found(locator: Locator, uri: str) -> Path | Why:
    try:
        return locator.find(uri)
    except Missing as missing:
        return missing.why


def test_a_file_that_may_not_be_given_away_says_so_in_the_report(tmp_path: Path) -> None:
    make(tmp_path, {"files": {"arm/urdf/arm.urdf": "", ".ssh/id_rsa": "secret"}})
    with pytest.raises(Missing, match="is not a mesh or an image by its name; searched ") as refused:
        Locator(tmp_path / "arm/urdf/arm.urdf", ros=RosPaths()).find("package://.ssh/id_rsa")
    assert refused.value.places_for_report()[-1].endswith(
        "(refused: `package://.ssh/id_rsa` is not a mesh or an image by its name)"
    )


def test_the_environment_says_where_ros_has_its_packages(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make(
        tmp_path,
        {
            "files": {
                "place/arm.urdf": "",
                "opt/share/hand/a.stl": "",
                "src/foot/package.xml": "<name>foot</name>",
                "src/foot/b.stl": "",
            }
        },
    )
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "opt"))
    monkeypatch.setenv("ROS_PACKAGE_PATH", os.pathsep.join(["relative", str(tmp_path / "src")]))
    locator = Locator(tmp_path / "place/arm.urdf")
    assert locator.find("package://hand/a.stl") == (tmp_path / "opt/share/hand/a.stl").resolve()
    assert locator.find("package://foot/b.stl") == (tmp_path / "src/foot/b.stl").resolve()


def test_a_folder_stands_for_its_only_urdf(tmp_path: Path) -> None:
    make(
        tmp_path,
        {
            "files": {
                "arm/urdf/arm.URDF": "",
                "arm/urdf/arm.csv": "",
                "two/a.urdf": "",
                "two/b.urdf": "",
                "none/a.xacro": "",
            }
        },
    )
    assert find_urdf(tmp_path / "arm") == tmp_path / "arm/urdf/arm.URDF"
    # The file is expanded; within a folder it is not guessed.
    assert find_urdf(tmp_path / "none/a.xacro") == tmp_path / "none/a.xacro"
    for path, sentence in [
        ("two", "holds several .urdf files; name one of"),
        ("none", "holds no .urdf file"),
        ("gone.urdf", "cannot read"),
    ]:
        with pytest.raises(NoUrdf, match=sentence):
            find_urdf(tmp_path / path)
