"""Meshes as arrays, progress bars, xacro files and plots."""

from __future__ import annotations

import io
import shutil
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from daemon import ASSETS, Daemon

import simd_client
from simd_client import Robot, Simulation, aio
from simd_client.progress import OwnBar

CORNERS = np.array([[0, 0, 0], [0.2, 0, 0], [0, 0.2, 0], [0, 0, 0.2]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


class Bar:
    """Records its calls, as a `tqdm` would show them."""

    made: list[Bar] = []

    def __init__(self, *, total: int, desc: str, unit: str, unit_scale: bool) -> None:
        self.total, self.desc, self.unit, self.unit_scale = total, desc, unit, unit_scale
        self.done, self.is_closed = 0, False
        Bar.made.append(self)

    def update(self, n: int, /) -> None:
        self.done += n

    def close(self) -> None:
        self.is_closed = True


@pytest.fixture
def bars() -> list[Bar]:
    Bar.made = []
    return Bar.made


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A robot with meshes that no daemon has seen."""
    folder = tmp_path / "Two Link.v2"
    shutil.copytree(ASSETS / "Two Link.v2", folder)
    for index, mesh in enumerate(sorted((folder / "meshes").iterdir())):
        data = bytearray(mesh.read_bytes())
        # The header of a binary STL is free text.
        data[:24] = f"{index:04} {id(tmp_path):019}".encode()
        mesh.write_bytes(data)
    return folder


def test_a_mesh_of_arrays_falls_and_comes_to_rest(sim: Simulation) -> None:
    sim.add_plane()
    mesh = sim.add_mesh((CORNERS, FACES), position=(0, 0, 0.05), color=(1, 0, 0))
    # A corner of a cube: a sixth of it, of water.
    assert mesh.info().mass == pytest.approx(1000 * 0.2**3 / 6, rel=1e-6)
    sim.step(2000)
    assert mesh.pose.position[2] == pytest.approx(0.0, abs=2e-3)
    trimesh: Any = SimpleNamespace(vertices=CORNERS.tolist(), faces=FACES.tolist())
    scaled = sim.add_mesh(trimesh, 2.0, (1, 0, 0), scale=(2, 2, 2), fixed=True)
    assert scaled.name == "mesh_1" and scaled.info().mass == pytest.approx(2.0)
    hit = sim.cast_rays([1.01, 0.01, 2], [[1.01, 0.01, -1]])
    assert hit.robots[0] == "mesh_1" and hit.points[0][2] == pytest.approx(0.4 - 0.02, abs=1e-6)


def arch() -> tuple[Any, Any]:
    """Corners and triangles of two legs and a bar between them."""
    boxes = [((0, 0, 0), (0.1, 1, 1)), ((0.9, 0, 0), (1, 1, 1)), ((0.1, 0, 0.9), (0.9, 1, 1))]
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    sides = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]  # fmt: skip
    vertices = np.concatenate([np.array(low) + corners * (np.array(high) - low) for low, high in boxes])
    faces = np.concatenate([np.array(sides) + 8 * index for index in range(3)])
    return vertices, faces


@pytest.mark.parametrize(
    ("collision", "fixed", "closed"),
    [("mesh", True, False), ("mesh", False, True), ("hull", True, True), ("parts", False, False)],
)
def test_a_file_says_what_its_meshes_are_to_become(
    sim: Simulation, tmp_path: Path, collision: Any, fixed: bool, closed: bool
) -> None:
    """A ray between the legs of an arch hits the hull that closes it."""
    vertices, faces = arch()
    lines = [*("v {} {} {}".format(*each) for each in vertices), *("f {} {} {}".format(*each) for each in faces + 1)]
    (tmp_path / "arch.obj").write_text("\n".join(lines))
    shape = '<collision><geometry><mesh filename="arch.obj"/></geometry></collision>'
    inertial = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
    urdf = tmp_path / "arch.urdf"
    urdf.write_text(f'<robot name="arch"><link name="base">{inertial}{shape}</link></robot>')
    robot = sim.load(urdf, fixed=fixed, collision=collision)
    hit = sim.cast_rays([0.5, -1, 0.3], [[0.5, 2, 0.3]])
    assert hit.hit.tolist() == [closed]
    became = "collides by its triangles" if not closed and fixed else "convex hull" if closed else "convex part"
    assert robot.report and any(became in each.message for each in robot.report.findings)


def test_another_word_for_collision_is_refused(sim: Simulation) -> None:
    word: Any = "meshes"
    with pytest.raises(ValueError, match="'mesh', 'hull' or 'parts', and not 'meshes'"):
        sim.load(ASSETS / "seven_arm", collision=word)


def test_a_mesh_of_a_file_and_one_in_convex_parts(sim: Simulation) -> None:
    part = ASSETS / "Two Link.v2" / "meshes" / "forearm.STL"
    assert sim.add_mesh(part, name="from_file", fixed=True).links == ("link",)
    vertices, faces = arch()
    # A ray between the legs meets the hull, and not the parts.
    sim.add_mesh((vertices, faces), name="hull")  # one that can move
    sim.add_mesh((vertices, faces), fixed=True, name="arch", position=(5, 0, 0), convex_parts=True)
    hits = sim.cast_rays([[0.5, -1, 0.3], [5.5, -1, 0.3]], [[0.5, 2, 0.3], [5.5, 2, 0.3]])
    assert hits.hit.tolist() == [True, False]


@pytest.mark.parametrize(
    ("vertices", "faces", "match"),
    [
        (CORNERS[:, :2], FACES, "rows of 3 numbers"),
        (CORNERS * np.nan, FACES, "not finite"),
        (CORNERS, FACES + 1, "not one of the 4"),
        (CORNERS, FACES * 0.5, "whole numbers"),
        (CORNERS, FACES[:0], "rows of 3 indices"),
        ([], [], "rows of 3 numbers"),
    ],
)
def test_arrays_that_are_no_mesh_are_refused(sim: Simulation, vertices: Any, faces: Any, match: str) -> None:
    with pytest.raises(ValueError, match=match):
        sim.add_mesh((vertices, faces))
    assert sim.robots == {}


def test_a_file_that_is_no_mesh_is_refused(sim: Simulation, tmp_path: Path) -> None:
    text = tmp_path / "notes.txt"
    text.write_text("no mesh")
    with pytest.raises(simd_client.InvalidDescription, match=r"notes.txt"):
        sim.add_mesh(text)
    with pytest.raises(ValueError, match="a scale of 0"):
        sim.add_mesh((CORNERS, FACES), scale=(0, 1, 1))
    with pytest.raises(FileNotFoundError):
        sim.add_mesh(tmp_path / "nowhere.stl")
    with pytest.raises(simd_client.InvalidValue, match="scale"):
        sim.add_mesh((CORNERS, FACES), scale=(1, np.nan, 1))
    assert sim.robots == {}


def test_bars_show_what_is_sent_and_read(sim: Simulation, package: Path, bars: list[Bar]) -> None:
    arm = sim.load(package, "arm", fixed=True, progress=Bar)
    assert arm.joint_names == ("shoulder joint", "elbow joint")
    sent = bars[0]
    assert sent.desc == "Two Link.v2.urdf: sending" and sent.unit == "B" and sent.unit_scale
    assert sent.done == sent.total == sum(mesh.stat().st_size for mesh in (package / "meshes").iterdir())
    assert all(bar.is_closed and bar.done <= bar.total for bar in bars)
    assert all(bar.desc.startswith("Two Link.v2: ") and bar.unit == "files" for bar in bars[1:])
    # The daemon has all files now.
    before = len(bars)
    sim.load(package, "again", fixed=True, progress=Bar)
    assert not [bar for bar in bars[before:] if bar.unit == "B"]


def test_bars_are_closed_if_the_robot_is_refused(sim: Simulation, package: Path, bars: list[Bar]) -> None:
    sim.load(package, "arm", fixed=True)
    shutil.rmtree(package / "meshes" / "none", ignore_errors=True)
    with pytest.raises(simd_client.RobotExists):
        sim.load(package, "arm", fixed=True, progress=Bar)
    assert all(bar.is_closed for bar in bars)


async def test_asyncio_shows_bars_too(sim: Simulation, daemon: Daemon, package: Path, bars: list[Bar]) -> None:
    async with aio.connect(daemon.endpoint) as connected:
        assert (await connected.load(package, "arm", fixed=True, progress=Bar)).name == "arm"
    assert bars and all(bar.is_closed for bar in bars)


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_a_bar_of_a_terminal_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", terminal := Terminal())
    monkeypatch.setenv("COLUMNS", "120")
    bar = OwnBar(total=2_000_000, desc="arm\x1b[2J", unit="B", unit_scale=True)
    bar.update(500_000)
    bar.update(1_500_000)
    bar.close()
    drawn = terminal.getvalue().split("\r\x1b[K")
    assert drawn[1] == "arm\\u{1b}[2J:   0% |" + " " * 30 + "| 0/2M B"
    assert drawn[-1] == "arm\\u{1b}[2J: 100% |" + "#" * 30 + "| 2M/2M B\n"


def test_a_bar_that_is_not_shown_draws_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", stream := io.StringIO())
    bar = OwnBar(total=1, desc="arm", unit="files", unit_scale=False)
    bar.update(1)
    bar.close()
    assert stream.getvalue() == ""


def test_a_bar_of_a_notebook_is_drawn_again_in_its_place(monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[str] = []
    handle = SimpleNamespace(update=shown.append)

    def display(html: str, display_id: bool) -> object:
        assert display_id
        shown.append(html)
        return handle

    kernel: Any = ModuleType("IPython")
    kernel.get_ipython = lambda: SimpleNamespace(kernel=object())
    displays: Any = ModuleType("IPython.display")
    displays.HTML, displays.display = str, display
    monkeypatch.setitem(sys.modules, "IPython", kernel)
    monkeypatch.setitem(sys.modules, "IPython.display", displays)
    bar = OwnBar(total=4, desc="<arm>", unit="files", unit_scale=False)
    bar.update(4)
    assert shown == [
        "&lt;arm&gt; <progress value=0.000 max=1></progress> 0/4 files",
        "&lt;arm&gt; <progress value=1.000 max=1></progress> 4/4 files",
    ]


XACRO = """<robot name="pendulum" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:arg name="length" default="0.5"/>
  <xacro:include filename="$(find our_parts)/rod.xacro"/>
  <xacro:rod length="${$(arg length) * 2}"/>
</robot>
"""
ROD = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:macro name="rod" params="length">
  <link name="rod">
    <inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><box size="0.1 0.1 ${length}"/></geometry></collision>
    <visual><geometry><mesh filename="file://$(find our_parts)/meshes/rod.stl"/></geometry></visual>
  </link>
</xacro:macro></robot>
"""


@pytest.fixture
def xacro_file(tmp_path: Path) -> Path:
    """A robot with a macro and a mesh of another package."""
    parts = tmp_path / "elsewhere" / "parts"
    (parts / "meshes").mkdir(parents=True)
    (parts / "package.xml").write_text("<package><name>our_parts</name></package>")
    (parts / "rod.xacro").write_text(ROD)
    shutil.copy(ASSETS / "Two Link.v2" / "meshes" / "forearm.STL", parts / "meshes" / "rod.stl")
    robot = tmp_path / "pendulum.urdf.xacro"
    robot.write_text(XACRO)
    return robot


def test_a_xacro_file_is_expanded_with_its_arguments(sim: Simulation, xacro_file: Path) -> None:
    packages = {"our_parts": xacro_file.parent / "elsewhere" / "parts"}
    rod = sim.load(xacro_file, packages=packages, xacro_arguments={"length": 0.25})
    (collision,) = rod.scene().collisions
    assert collision.box.size.z == 0.5
    # The mesh was sent, and no path of this disk was.
    (visual,) = rod.scene().visuals
    assert visual.mesh.uri == "package://our_parts/meshes/rod.stl" and visual.mesh.sha256
    rod.reload_from(xacro_file, packages=packages)
    assert rod.scene().collisions[0].box.size.z == 1.0
    assert sim.validate(xacro_file, packages=packages).summary.startswith("pendulum")


def test_failed_expansions_say_why(
    sim: Simulation, xacro_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(simd_client.XacroError, match="there is no package `our_parts`: say where"):
        sim.load(xacro_file)
    with pytest.raises(simd_client.XacroError, match="takes no xacro arguments"):
        sim.load(ASSETS / "Two Link.v2", xacro_arguments={"length": 1})
    monkeypatch.setitem(sys.modules, "xacro", None)
    with pytest.raises(simd_client.XacroError, match="pip install 'xacro>=2.1,<3'"):
        sim.load(xacro_file)


def test_states_are_plotted_over_simulated_time(sim: Simulation, arm: Robot) -> None:
    states = [sim.step(10, {arm: [0.1, 0.2]}, states=arm)[arm] for _ in range(5)]
    figure = arm.plot(states, what=("position", "effort"))
    above, below = figure.axes
    assert [line.get_label() for line in above.lines] == ["shoulder joint", "elbow joint"]
    np.testing.assert_allclose(above.lines[0].get_xdata(), [0.01, 0.02, 0.03, 0.04, 0.05])
    np.testing.assert_array_equal(below.lines[1].get_ydata(), [state["elbow joint"].effort for state in states])
    assert (above.get_ylabel(), below.get_ylabel()) == ("position [rad]", "effort [N m]")
    assert arm.plot(states, what=("velocity",), joints=["elbow joint"], axes=above) is figure
    with pytest.raises(ValueError, match="no `speed` to plot"):
        arm.plot(states, what=("speed",))
    with pytest.raises(ValueError, match="nothing to plot"):
        arm.plot([])
    with pytest.raises(simd_client.WrongState):
        arm.plot()


def test_a_robot_is_watched_and_plotted(sim: Simulation, arm: Robot) -> None:
    sim.play()
    times = arm.plot(seconds=0.2).axes[0].lines[0].get_xdata()
    assert 0.2 <= times[-1] - times[0] < 0.4 and (np.diff(times) > 0).all()
