"""A panel of a robot in a notebook: its Python side. A person checks the page's side."""

from __future__ import annotations

import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from daemon import Daemon, within

import simd_client
from simd_client import Robot, Simulation
from simd_client.widget import panel


@pytest.fixture
def shown(arm: Robot) -> Any:
    pytest.importorskip("anywidget")
    widget = panel(arm, rate=50)
    yield widget
    widget.close()


def until(condition: Any) -> None:
    stop = within()
    while not condition() and time.monotonic() < stop:
        pass
    assert condition()


def test_it_shows_where_the_joints_are_and_what_is_asked_of_them(sim: Simulation, arm: Robot, shown: Any) -> None:
    assert [row["name"] for row in shown.joints] == list(arm.joint_names)
    assert shown.robot == "arm" and all(row["lower"] < row["upper"] and row["unit"] == "rad" for row in shown.joints)
    arm.reset_joints([0.3, -0.2])
    until(lambda: shown.positions == pytest.approx([0.3, -0.2]))
    arm.set_positions([0.1, 0.2])
    sim.step(10)
    until(lambda: shown.targets == pytest.approx([0.1, 0.2]) and shown.time == pytest.approx(0.01))


def test_a_slider_sets_a_target_and_a_refusal_is_shown(daemon: Daemon, arm: Robot, shown: Any) -> None:
    shown.wanted = [1, 0.25, 1]
    assert arm.read()["elbow joint"].target == 0.25 and shown.problem == ""
    with simd_client.connect(daemon.endpoint) as other, other.robot("arm").claim(holder="calibration"):
        shown.wanted = [1, 0.5, 2]
        assert "calibration" in shown.problem and arm.read()["elbow joint"].target == 0.25
    shown.wanted = [0, -0.5, 3]
    assert arm.read()["shoulder joint"].target == -0.5 and shown.problem == ""


def test_missing_packages_are_reported(arm: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "anywidget", None)
    with pytest.raises(ImportError, match="pip install 'anywidget>=0.9'"):
        panel(arm)


@pytest.mark.skipif(shutil.which("node") is None, reason="node is not there")
def test_its_script_is_a_module_that_draws(tmp_path: Path) -> None:
    """Only the used part of a document."""
    source = Path(sys.modules["simd_client.widget"].__file__ or "").with_name("panel.js").read_text()
    (tmp_path / "panel.mjs").write_text(source)
    (tmp_path / "run.mjs").write_text(
        """
        import panel from "./panel.mjs";
        const made = [];
        globalThis.document = { createElement: (tag) => {
          const heard = {};
          const element = { tag, style: {}, children: [], textContent: "", append(...all) { this.children.push(...all); },
            setAttribute() {}, addEventListener(name, f) { heard[name] = f; }, heard };
          made.push(element);
          return element;
        } };
        const values = { joints: [{ name: "elbow", lower: -1, upper: 1, unit: "rad" }], positions: [0.5], targets: [0.25],
          time: 1.5, robot: "arm", problem: "" };
        const saved = [];
        const heard = {};
        const model = { get: (name) => values[name], set: (name, value) => saved.push([name, value]), save_changes() {},
          on: (name, f) => { heard[name] = f; }, off: (name) => { delete heard[name]; } };
        const end = panel.render({ model, el: { append() {} } });
        const slider = made.find((each) => each.tag === "input");
        const bar = made.find((each) => each.tag === "progress");
        if (slider.value !== 0.25 || bar.value !== 0.75) throw new Error(`${slider.value} ${bar.value}`);
        slider.value = "-0.5";
        slider.heard.input();
        if (JSON.stringify(saved) !== '[["wanted",[0,-0.5,1]]]') throw new Error(JSON.stringify(saved));
        values.positions = [-1];
        heard["change:positions"]();
        if (bar.value !== 0) throw new Error(`${bar.value}`);
        end();
        if (Object.keys(heard).length) throw new Error("it still listens");
        """
    )
    ran = subprocess.run(["node", str(tmp_path / "run.mjs")], capture_output=True, text=True, timeout=60)
    assert ran.returncode == 0, ran.stderr
