"""Robots are loaded from this disk into the world, and are objects there."""

from __future__ import annotations

import hashlib
import shutil
from pathlib import Path

import numpy as np
import pytest
from daemon import ASSETS

import simd_client
from simd_client import JointMode, JointType, Pose, Robot, Simulation, Twist

BOX = '<robot name="box"><link name="body"><inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>'


def test_a_package_folder_is_loaded_with_its_meshes(sim: Simulation) -> None:
    arm = sim.load(ASSETS / "Two Link.v2", name="arm", fixed=True, position=(0, 0, 1))
    assert (arm.name, arm.links, arm.joint_names) == (
        "arm",
        ("base_link", "upper arm", "forearm"),
        ("shoulder joint", "elbow joint"),
    )
    assert arm.report.summary.startswith("two_link: 3 links, 2 moving joints")
    assert not any("mesh" in finding.message for finding in arm.report.warnings), arm.report
    np.testing.assert_array_equal(arm.pose.position, [0, 0, 1])
    mesh = next(visual.mesh for visual in arm.scene().visuals if visual.HasField("mesh"))
    file = ASSETS / "Two Link.v2/meshes" / mesh.uri.rsplit("/", 1)[-1]
    assert sim.asset(mesh.sha256) == file.read_bytes()


def test_the_materials_and_pictures_of_a_mesh_come_along(sim: Simulation) -> None:
    for kind in ("obj", "dae", "gltf"):
        box = sim.load(ASSETS / f"textured/urdf/{kind}.urdf", name=kind, fixed=True)
        assert not box.report.warnings, box.report
        mesh = next(visual.mesh for visual in box.scene().visuals if visual.HasField("mesh"))
        assert mesh.look not in ("", mesh.sha256)
    picture = (ASSETS / "textured/pictures/squares.png").read_bytes()
    assert sim.asset(hashlib.sha256(picture).hexdigest()) == picture


def test_a_mesh_that_is_not_found_is_a_warning_that_says_where_it_was_looked_for(
    sim: Simulation, tmp_path: Path
) -> None:
    package = tmp_path / "Two Link.v2"
    shutil.copytree(ASSETS / "Two Link.v2", package)
    (package / "meshes" / "forearm.STL").unlink()
    report = sim.validate(package)
    assert any(
        "forearm.STL" in finding.message and str(package) in finding.message for finding in report.warnings
    )
    assert sim.robots == {}
    with pytest.raises(simd_client.InvalidDescription):
        sim.load(package, strict=True)


def test_a_file_with_several_robots_is_validated_whole_or_one_robot_at_a_time(
    sim: Simulation, tmp_path: Path
) -> None:
    world = tmp_path / "world.sdf"
    models = "".join(f'<model name="{name}"><link name="body"/></model>' for name in ("left", "right"))
    world.write_text(f'<sdf version="1.9"><world name="w">{models}</world></sdf>')
    assert sim.validate(world).summary.count("1 link") == 2
    assert sim.validate(world, model="right").summary.startswith("right: 1 link")
    absent = sim.validate(world, model="middle").summary
    assert '"middle"' in absent and '"left", "right"' in absent
    assert sim.robots == {}


def test_a_file_that_changes_while_it_is_sent_is_refused(sim: Simulation, tmp_path: Path) -> None:
    from simd_client.blocking.upload import send_file

    file = tmp_path / "a.stl"
    file.write_bytes(b"other")
    with pytest.raises(simd_client.UploadMismatch):
        send_file(sim, file, "0" * 64)


def test_a_text_without_files_is_loaded_in_one_call(sim: Simulation) -> None:
    box = sim.load_text(BOX)
    assert (box.name, box.info().mass, box.info().is_fixed) == ("box", 2.0, False)
    sim.step(100)
    assert box.pose.position[2] == pytest.approx(-9.81 * 0.1**2 / 2, rel=1e-9)
    assert box.twist.linear[2] == pytest.approx(-0.981, rel=1e-9)


def test_a_name_that_is_taken_is_refused_or_made_another(sim: Simulation) -> None:
    sim.load_text(BOX, "crate", scale=2.0)
    with pytest.raises(simd_client.RobotExists) as refused:
        sim.load_text(BOX, "crate")
    assert refused.value.metadata["robot"] == "crate"
    assert sim.load_text(BOX, "crate", allow_renaming=True).name == "crate_1"
    assert list(sim.robots) == ["crate", "crate_1"]


def test_invalid_robots_are_refused_with_the_line(sim: Simulation) -> None:
    with pytest.raises(simd_client.InvalidDescription):
        sim.load_text("<robot name='x'>\n<link/></robot>")
    with pytest.raises(simd_client.NoUrdf, match="cannot read"):
        sim.load("/nowhere/arm.urdf")
    with pytest.raises(simd_client.PathNotAllowed):
        sim.load_on_daemon("/etc/passwd")


def test_a_root_link_is_put_elsewhere_and_pushed(sim: Simulation) -> None:
    sim.set_physics(gravity=(0, 0, 0))
    box = sim.load_text(BOX)
    box.set_state(Pose.of((1, 2, 3), (0, 0, 1, 0)), Twist.of(linear=(0.5, 0, 0)))
    assert box.pose == Pose.of((1, 2, 3), (0, 0, 1, 0))
    assert box.twist == Twist.of((0.5, 0, 0))
    np.testing.assert_allclose(box.pose.matrix() @ [1, 0, 0, 1], [0, 2, 3, 1], atol=1e-12)
    box.apply_wrench("body", force=(0, 0, 4), persistent=True)
    sim.step(100)
    # 4 N on 2 kg for 0.1 s.
    assert box.twist.linear[2] == pytest.approx(0.2, rel=1e-9)
    assert box.link_poses()["body"] == box.pose
    with pytest.raises(simd_client.LinkNotFound):
        box.apply_wrench("lid", force=(0, 0, 1))


def test_a_link_is_pulled_to_a_point_and_let_go(sim: Simulation) -> None:
    sim.set_physics(gravity=(0, 0, 0))
    box = sim.load_text(BOX)
    box.pull("body", (0.1, 0, 0), duration=10)
    sim.step(3000)
    # The default spring has 60 N/m for each kilogram: within a second it arrives.
    assert box.pose.position[0] == pytest.approx(0.1, abs=1e-4)
    box.pull("body", (0.4, 0, 0), stiffness=100, max_force=2, duration=10)
    sim.step(100)
    # 2 N on 2 kg for 0.1 s.
    assert box.twist.linear[0] == pytest.approx(0.1, abs=1e-3)
    box.pull("body", None)
    coasts = box.twist.linear[0]
    sim.step(100)
    assert box.twist.linear[0] == pytest.approx(coasts, rel=1e-9)
    with pytest.raises(simd_client.LinkNotFound):
        box.pull("lid", (0, 0, 1))


def test_a_new_export_is_reloaded_in_place_and_arrays_have_its_layout(
    sim: Simulation, tmp_path: Path
) -> None:
    package = tmp_path / "arm"
    shutil.copytree(ASSETS / "Two Link.v2", package)
    arm = sim.load(package, "arm", fixed=True)
    arm.reset_joints({"elbow joint": 0.25})
    urdf = next((package / "urdf").glob("*.urdf"))
    urdf.write_text(urdf.read_text().replace('"elbow joint"', '"wrist joint"'))
    reloaded = arm.reload_from(package)
    assert (reloaded.added_joints, reloaded.removed_joints) == (("wrist joint",), ("elbow joint",))
    assert arm.joint_names == ("shoulder joint", "wrist joint")
    assert arm.joints["wrist joint"].position == 0.0
    assert arm.reload().added_joints == ()


def test_a_layout_that_another_client_changed_is_fetched_again(sim: Simulation, daemon: object) -> None:
    arm = sim.load(ASSETS / "Two Link.v2", "arm", fixed=True)
    before = arm.layout
    with simd_client.connect(str(getattr(daemon, "endpoint"))) as other:
        other.robot("arm").delete()
        other.load(ASSETS / "branching", "arm", fixed=True)
    with pytest.raises(simd_client.LayoutChanged):
        arm.set_positions([0.0, 0.0])
    # The refusal has marked the layout stale.
    assert arm.layout.version != before.version
    assert arm.position.shape == (arm.layout.position_count,)
    assert arm.read().layout.version == arm.read().layout_version


def test_a_deleted_robot_is_not_found_and_its_object_can_still_be_shown(arm: Robot) -> None:
    arm.delete()
    with pytest.raises(simd_client.RobotNotFound):
        arm.read()
    assert "shoulder joint" in repr(arm) and "elbow joint" in arm._repr_html_()  # pyright: ignore[reportPrivateUsage]


def test_a_notebook_shows_a_robot_with_its_joints(arm: Robot) -> None:
    lines = repr(arm).splitlines()
    assert lines[0] == "<Robot arm: 2 of 2 joints move, fixed base, 1.86 kg>"
    assert lines[1].split() == ["joint", "type", "mode", "position", "velocity", "effort", "target"]
    assert lines[3].split() == ["elbow", "joint", "revolute", "hold", "0.0000", "0.0000", "0.0000", "0.0000"]
    assert "<td>elbow joint</td>" in arm._repr_html_()  # pyright: ignore[reportPrivateUsage]
    assert repr(arm.joints["elbow joint"]) == "<Joint 'arm/elbow joint': revolute, -2.1 to 2.4>"


def test_joints_are_known_by_name_and_by_index(arm: Robot) -> None:
    elbow = arm.joints["elbow joint"]
    assert arm.joints[1] is elbow and list(arm.joints) == ["shoulder joint", "elbow joint"]
    assert (elbow.type, elbow.limits.lower, elbow.limits.upper) == (JointType.REVOLUTE, -2.1, 2.4)
    assert elbow.info.parent_link == "upper arm" and elbow.mode is JointMode.HOLD
    with pytest.raises(
        KeyError, match="robot `arm` has no joint `knee`; it has `shoulder joint`, `elbow joint`"
    ):
        arm.joints["knee"]


def test_included_files_are_sent_and_one_robot_of_several_can_be_named(sim: Simulation, tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    leg = "<mujocoinclude><body name='leg' pos='2 0 1'><freejoint/><geom size='0.2' mass='3'/></body></mujocoinclude>"
    (tmp_path / "parts" / "leg.xml").write_text(leg)
    arm = "<body name='arm'><joint name='j'/><geom size='0.1' mass='1'/></body>"
    scene = tmp_path / "scene.xml"
    scene.write_text(f"<mujoco><worldbody>{arm}<include file='parts/leg.xml'/></worldbody></mujoco>")
    first = sim.load(scene, "scene")
    assert first.name == "scene_arm"
    assert set(sim.robots) >= {"scene_arm", "scene_leg"}
    alone = sim.load(scene, "alone", model="leg")
    assert alone.name == "alone"
    assert alone.info().mass == pytest.approx(3.0)
