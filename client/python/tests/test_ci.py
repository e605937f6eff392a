"""The page on tests in CI: its test, the steps of its jobs, and nodes of ROS 2 under test."""

from __future__ import annotations

import importlib
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from daemon import ASSETS, BINARY, REPOSITORY
from test_docs import CI, blocks
from test_pytest_plugin import environment

from simd_client import embedded_link

SECONDS = 120.0
yaml: Any = importlib.import_module("yaml")


def jobs() -> dict[str, list[str]]:
    """Returns the shell lines of each job on the page."""
    github, gitlab = re.findall(r"^```yaml\n(.*?)^```$", CI.read_text(), flags=re.MULTILINE | re.DOTALL)
    steps = yaml.safe_load(github)["jobs"]["test"]["steps"]
    return {
        "GitHub": [step["run"] for step in steps if "run" in step],
        "GitLab": yaml.safe_load(gitlab)["test"]["script"],
    }


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A project as on the page, and the working folder."""
    shutil.copytree(ASSETS / "seven_arm", tmp_path / "robot")
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests" / "test_arm.py").write_text(blocks(CI)[0])
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(lines: list[str]) -> tuple[int, str]:
    """Runs lines as a job does: up to the first that fails. The programs are those of this repository."""
    programs = os.pathsep.join([str(Path(sys.executable).parent), str(BINARY.resolve().parent), os.environ["PATH"]])
    ran = subprocess.run(
        ["bash", "-e", "-c", "\n".join(lines)],
        env={**environment(), "PATH": programs, "PYTEST_ADDOPTS": "-p no:cacheprovider"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=SECONDS,
    )
    return ran.returncode, ran.stdout


@pytest.mark.skipif(not embedded_link.is_installed(), reason="simd-embedded is not installed")
def test_the_steps_of_the_jobs_run_and_keep_what_the_page_says(project: Path) -> None:
    steps, others = jobs().values()
    assert steps == others
    install, *steps = steps
    # The tests' environment has these packages already; `make dist-check` installs the wheels.
    assert install == "pip install pytest mcap-ros2-support matplotlib wheels/simd_*.whl"
    code, said = run(steps)
    assert code == 0 and "1 passed" in said, said
    assert sorted(path.name for path in (project / "report").iterdir()) == ["junit.xml"]

    slow = (project / "tests" / "test_arm.py").read_text().replace("timeout=2.0", "timeout=0.1")
    (project / "tests" / "test_arm.py").write_text(slow)
    code, said = run(steps)
    (sentence,) = re.findall(r"^```text\n(joint .*?)\n```$", CI.read_text(), flags=re.MULTILINE | re.DOTALL)
    pattern = re.escape(sentence).replace(r"0\.31", r"[\d.]+").replace("2\\ s", r"[\d.]+\ s")
    assert code == 1 and re.search(pattern, said), said
    (replay,) = [line for line in CI.read_text().splitlines() if "--simd-replay report/" in line]
    kept = project / "report" / "simd-results" / "tests.test_arm.test_the_arm_reaches"
    assert {path.name for path in kept.iterdir()} == {"recording.mcap", "arm.png", "log.txt"}
    code, said = run([replay])
    assert code == 0 and said.rstrip().endswith("equal"), said

    (project / "robot" / "urdf" / "seven_arm.urdf").write_text("<robot name='x'><link name='a'/><link name='a'/></robot>")
    code, said = run(steps)
    assert code != 0 and "passed" not in said, "a description with a warning ends the job"


def test_the_block_on_nodes_runs_with_a_node_of_others(project: Path) -> None:
    pytest.importorskip("zenoh_ros2_sdk")
    node = REPOSITORY / "client" / "python" / "tests" / "ros2_node.py"
    block = blocks(CI)[1].replace('"ros2", "run", "my_package", "commander"', f'"{sys.executable}", "{node}"')
    assert str(node) in block
    imports = "from simd_client.testing import until\n"
    (project / "test_node.py").write_text(imports + block)
    code, said = run(["python -m pytest --simd-scope=session test_node.py"])
    assert code == 0 and "1 passed" in said, said
