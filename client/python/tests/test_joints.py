"""Joints are read and driven, one by one and as whole robots."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from daemon import ASSETS

import simd_client
from simd_client import Gains, JointFlag, JointMode, JointLimits, Robot, Simulation, Target, Tendon, Whole


def test_a_target_of_one_joint_is_gone_to_and_reached(sim: Simulation, arm: Robot) -> None:
    sim.set_physics(gravity=(0, 0, 0))
    elbow = arm.joints["elbow joint"]
    elbow.target = 0.5
    assert (elbow.mode, elbow.target) == (JointMode.POSITION, 0.5)
    sim.step(5000)
    # Dry friction holds the joint if the spring is too weak to overcome it.
    rest = elbow.info.friction / elbow.info.default_gains.stiffness
    assert elbow.position == pytest.approx(0.5, abs=rest + 1e-6) and rest < 1e-3
    assert elbow.velocity == pytest.approx(0.0, abs=1e-6)
    assert arm.joints["shoulder joint"].mode is JointMode.HOLD


def test_whole_robots_are_float64_arrays_in_joint_order(sim: Simulation, arm: Robot) -> None:
    applied = arm.set_positions(np.array([0.3, -0.2]))
    assert applied.clamped == () and applied.stamp.step == 0
    state = arm.read()
    for array in (arm.position, arm.velocity, arm.effort, arm.target, state.position):
        assert array.dtype == np.float64 and array.shape == (2,)
    np.testing.assert_array_equal(arm.target, [0.3, -0.2])
    assert state["elbow joint"].target == -0.2
    assert [joint.name for joint in state] == ["shoulder joint", "elbow joint"]
    assert state.mode.tolist() == [JointMode.POSITION] * 2


def test_every_mode_can_be_asked_for(arm: Robot) -> None:
    elbow = arm.joints["elbow joint"]
    for ask, mode, target in [
        (
            lambda: elbow.set_position(0.1, stiffness=50.0, damping=2.0, max_velocity=1.0),
            JointMode.POSITION,
            0.1,
        ),
        (lambda: elbow.set_velocity(0.2, max_effort=3.0), JointMode.VELOCITY, 0.2),
        (lambda: elbow.set_effort(0.3), JointMode.EFFORT, 0.3),
        (lambda: elbow.set_passive(), JointMode.PASSIVE, 0.0),
        (lambda: elbow.hold(), JointMode.HOLD, 0.0),
        (lambda: arm.set_velocities([0.0, 0.4]), JointMode.VELOCITY, 0.4),
        (lambda: arm.set_efforts([0.0, 0.5]), JointMode.EFFORT, 0.5),
        (lambda: arm.set_positions({"elbow joint": 0.6}), JointMode.POSITION, 0.6),
        (lambda: arm.set_passive(), JointMode.PASSIVE, 0.0),
        (lambda: arm.hold(), JointMode.HOLD, 0.0),
        (lambda: arm.set_targets({"elbow joint": Target.effort(0.7)}), JointMode.EFFORT, 0.7),
        (lambda: arm.set_targets(Whole.velocities([0, 0.8])), JointMode.VELOCITY, 0.8),
    ]:
        ask()
        state = elbow.read()
        assert (state.mode, state.target) == (mode, target)


def test_numbers_of_any_kind_are_taken(sim: Simulation) -> None:
    start = {"elbow joint": np.float32(0.5)}
    arm = sim.load(ASSETS / "Two Link.v2", "arm", fixed=True, joint_positions=start)  # pyright: ignore[reportArgumentType]
    assert arm.position.tolist() == [0.0, 0.5]
    arm.set_positions(np.array([1, 0]))
    arm.set_targets({"elbow joint": np.float32(0.25)})  # pyright: ignore[reportArgumentType]
    assert arm.target.tolist() == [1.0, 0.25]


def test_gains_of_a_target_are_in_force(arm: Robot) -> None:
    arm.joints["elbow joint"].set_position(0.1, stiffness=50.0, damping=2.0)
    arm.refresh()
    assert arm.joints["elbow joint"].info.gains == Gains(50.0, 2.0)


def test_a_target_beyond_a_limit_is_clamped_and_said_or_refused(arm: Robot) -> None:
    applied = arm.set_positions([0.0, 9.0])
    clamped = applied.clamped[0]
    assert (clamped.robot, clamped.joint, clamped.requested, clamped.applied) == (
        "arm",
        "elbow joint",
        9.0,
        2.4,
    )
    with pytest.raises(simd_client.TargetBeyondLimit) as refused:
        arm.joints["elbow joint"].set_position(-9.0, beyond_limit="refuse")
    assert refused.value.metadata["joint"] == "elbow joint"
    assert arm.target[1] == 2.4
    with pytest.raises(ValueError, match="beyond_limit is 'clamp' or 'refuse'"):
        arm.set_positions([0, 0], beyond_limit="ignore")  # pyright: ignore[reportArgumentType]


def test_an_array_of_another_length_is_refused_before_it_is_sent(arm: Robot) -> None:
    with pytest.raises(ValueError, match=r"robot `arm` takes 2 values \(shoulder joint, elbow joint\)"):
        arm.set_positions([1.0, 2.0, 3.0])
    with pytest.raises(simd_client.InvalidValue) as refused:
        arm.set_positions([0.0, float("nan")])
    assert isinstance(refused.value, ValueError)


def test_joints_are_put_at_positions_and_velocities(arm: Robot) -> None:
    arm.reset_joints({"elbow joint": 0.5}, {"elbow joint": 1.5})
    assert (arm.position[1], arm.velocity[1]) == (0.5, 1.5)
    arm.reset_joints([0.1, 0.2], [0.3, 0.4])
    np.testing.assert_array_equal(arm.position, [0.1, 0.2])
    np.testing.assert_array_equal(arm.velocity, [0.3, 0.4])
    arm.joints[0].reset(0.7)
    assert arm.position[0] == 0.7
    arm.reset_joints()
    np.testing.assert_array_equal(arm.position, [0, 0])
    with pytest.raises(ValueError, match="a velocity and no position"):
        arm.reset_joints({}, {"elbow joint": 1.0})


def test_velocities_and_efforts_are_taken_by_name_and_with_units(arm: Robot) -> None:
    arm.set_velocities({"elbow joint": "30rpm"})
    assert (arm.joints["elbow joint"].mode, arm.joints["elbow joint"].target) == (JointMode.VELOCITY, pytest.approx(math.pi))
    arm.set_efforts({"elbow joint": "3Nm", "shoulder joint": 0.5})
    assert arm.target.tolist() == [0.5, 3.0] and arm.joints["elbow joint"].mode is JointMode.EFFORT
    for refuse in (
        lambda: arm.set_velocities({"elbow joint": "3mm/s"}),
        lambda: arm.set_efforts({"elbow joint": "3N"}),
        lambda: arm.joints["elbow joint"].set_velocity("3mm/s"),
        lambda: arm.joints["elbow joint"].set_position("3mm"),
    ):
        with pytest.raises(ValueError, match="does not fit joint `elbow joint`, which turns"):
            refuse()
    with pytest.raises(ValueError, match="units need names of joints, as in {'shoulder joint': '90deg'}"):
        arm.set_positions(["90deg", "0deg"])


def test_a_reset_beyond_a_limit_is_judged_as_a_target_is(arm: Robot) -> None:
    elbow = arm.joints["elbow joint"]
    clamped = elbow.reset(9.0).clamped
    assert [(each.joint, each.requested, each.applied) for each in clamped] == [("elbow joint", 9.0, 2.4)]
    assert elbow.position == 2.4
    assert arm.reset_joints([0.0, -9.0]).clamped[0].applied == -2.1
    with pytest.raises(simd_client.TargetBeyondLimit, match=r"position 9 of joint `elbow joint` .* its limits, -2.1 to 2.4"):
        arm.reset_joints({"elbow joint": 9.0}, beyond_limit="refuse")
    assert arm.position[1] == -2.1
    assert elbow.reset(9.0, beyond_limit="keep").clamped == () and elbow.position == 9.0
    with pytest.raises(ValueError, match="beyond_limit is 'clamp' or 'refuse' or 'keep', not 'ignore'"):
        elbow.reset(0.0, beyond_limit="ignore")  # pyright: ignore[reportArgumentType]


def test_a_start_beyond_a_limit_is_judged_as_a_target_is(sim: Simulation) -> None:
    start = {"elbow joint": 9.0}
    arm = sim.load(ASSETS / "Two Link.v2", "arm", fixed=True, joint_positions=start)
    assert arm.position.tolist() == [0.0, 2.4]
    assert "joint_positions has 9, which is beyond the limit; the joint starts at 2.4" in str(arm.report)
    with pytest.raises(simd_client.TargetBeyondLimit):
        sim.load(ASSETS / "Two Link.v2", "other", fixed=True, joint_positions=start, beyond_limit="refuse")
    assert list(sim.robots) == ["arm"]
    kept = sim.load(ASSETS / "Two Link.v2", "kept", fixed=True, joint_positions=start, beyond_limit="keep")
    assert kept.position.tolist() == [0.0, 9.0]


def test_starts_are_taken_with_units_and_as_arrays(sim: Simulation) -> None:
    arm = sim.load(ASSETS / "Two Link.v2", "arm", fixed=True, joint_positions={"elbow joint": "90deg"})
    assert arm.position.tolist() == [0.0, math.pi / 2]
    other = sim.load(ASSETS / "Two Link.v2", "other", fixed=True, joint_positions=[0.1, 0.2])
    assert other.position.tolist() == [0.1, 0.2]
    with pytest.raises(ValueError, match="does not fit joint `elbow joint`"):
        sim.load(ASSETS / "Two Link.v2", "third", fixed=True, joint_positions={"elbow joint": "9mm"})
    assert list(sim.robots) == ["arm", "other"]


def test_limits_are_taken_with_units(arm: Robot) -> None:
    arm.joints["elbow joint"].set_properties(limits=JointLimits.of("-90deg", "90deg", "12Nm", "30rpm"))
    assert arm.joints["elbow joint"].limits == JointLimits(-math.pi / 2, math.pi / 2, 12.0, math.pi)


def test_errors_name_values_and_joints_as_they_were_typed(arm: Robot) -> None:
    nan = float("nan")
    elbow = arm.joints["elbow joint"]
    for call, said in [
        (lambda: arm.set_positions([0.0, nan]), "position nan of joint `elbow joint` of robot `arm` (value 1 of the array)"),
        (lambda: elbow.set_position(nan), 'position (joint "elbow joint") is NaN'),
        (lambda: elbow.set_position(0.0, stiffness=-1.0), 'stiffness (joint "elbow joint") is -1'),
        (lambda: elbow.reset(nan), 'position (joint "elbow joint") is NaN'),
        (lambda: elbow.set_properties(limits=JointLimits(1.0, -1.0)), 'limits.lower (joint "elbow joint") is 1'),
    ]:
        with pytest.raises(simd_client.InvalidValue) as refused:
            call()
        assert str(refused.value).startswith(said)
    with pytest.raises(simd_client.JointNotFound, match="did you mean `elbow joint`"):
        arm.joints["elbw joint"]
    with pytest.raises(IndexError, match="robot `arm` has 2 joints, and none with the index 9"):
        arm.joints[9]


def test_properties_change_and_the_rest_stays(sim: Simulation, arm: Robot) -> None:
    elbow = arm.joints["elbow joint"]
    friction = elbow.info.friction
    elbow.set_properties(damping=0.75, limits=JointLimits(-1.0, 1.0, 5.0, 2.0), default_gains=Gains(30.0, 3.0))
    info = arm.joints["elbow joint"].info
    assert (info.damping, info.friction) == (0.75, friction)
    assert info.limits == JointLimits(-1.0, 1.0, 5.0, 2.0) and info.default_gains == Gains(30.0, 3.0)
    assert arm.set_positions([0, 3.0]).clamped[0].applied == 1.0
    arm.joints["elbow joint"].set_properties(limits=JointLimits(), profile=False)
    assert arm.joints["elbow joint"].limits == JointLimits() and info.profile
    assert not arm.joints["elbow joint"].info.profile


def test_flags_say_where_a_joint_is_at_its_limit(sim: Simulation, arm: Robot) -> None:
    arm.reset_joints({"elbow joint": 2.4})
    assert JointFlag.AT_UPPER_LIMIT in arm.read()["elbow joint"].flags
    assert JointFlag.AT_UPPER_LIMIT not in arm.read()["shoulder joint"].flags


def test_some_joints_are_read_in_the_order_that_was_asked_for(sim: Simulation, arm: Robot) -> None:
    arm.reset_joints([0.1, 0.2])
    state = sim.states({"arm": ["elbow joint", "shoulder joint"]})[arm]
    np.testing.assert_array_equal(state.position, [0.2, 0.1])
    assert state["elbow joint"].position == 0.2 and state["shoulder joint"].position == 0.1
    assert arm.states(["elbow joint"]).position.tolist() == [0.2]
    with pytest.raises(KeyError):
        arm.states(["elbow joint"])["shoulder joint"]


def test_planar_joints_have_three_values_and_fixed_ones_none(sim: Simulation) -> None:
    robot = sim.load(ASSETS / "planar")
    joint = next(info for info in robot.layout.joints if info.dof == 3)
    robot.reset_joints(np.arange(robot.layout.position_count) * 0.01)
    np.testing.assert_allclose(robot.position, np.arange(robot.layout.position_count) * 0.01, atol=1e-12)
    np.testing.assert_array_equal(robot.read()[joint.name].positions, robot.position[joint.positions])
    with pytest.raises(ValueError, match="has 3 values and not one"):
        robot.joints[joint.name].position
    robot.set_targets({joint.name: [0.1, 0.2, Target.velocity(0.3)]})
    np.testing.assert_allclose(robot.target[joint.velocities], [0.1, 0.2, 0.3])
    robot.set_positions(robot.position)
    np.testing.assert_allclose(robot.target[joint.velocities], robot.position[joint.positions])


def test_targets_for_several_robots_hold_from_one_step_or_none_does(sim: Simulation, arm: Robot) -> None:
    other = sim.load(ASSETS / "Two Link.v2", "other", fixed=True)
    sim.set_targets({arm: [0.1, 0.2], "other": {"elbow joint": 0.3}})
    assert arm.target.tolist() == [0.1, 0.2] and other.target[1] == 0.3
    with pytest.raises(simd_client.JointNotFound) as refused:
        sim.set_targets({arm: [0.5, 0.5], other: {"knee": 0.3}})
    assert refused.value.metadata == {"robot": "other", "joint": "knee"}
    assert arm.target.tolist() == [0.1, 0.2]
    states = sim.states([arm, other])
    assert set(states) == {"arm", "other"} and states[arm].stamp == states["other"].stamp


def test_numbers_have_simctls_units(sim: Simulation, arm: Robot) -> None:
    elbow = arm.joints["elbow joint"]
    arm.set_positions({"elbow joint": "90deg"})
    assert elbow.target == pytest.approx(math.pi / 2)
    elbow.set_position("-0.5 rad", velocity="60rpm")
    assert elbow.target == -0.5
    elbow.set_velocity("1rpm")
    assert elbow.target == pytest.approx(math.tau / 60)
    elbow.set_effort("0.25Nm")
    assert elbow.target == 0.25
    arm.reset_joints({"elbow joint": "10deg"}, {"elbow joint": "20deg/s"})
    state = elbow.read()
    assert (state.position, state.velocity) == pytest.approx((math.radians(10), math.radians(20)))


def test_a_unit_that_does_not_fit_is_refused(sim: Simulation, arm: Robot) -> None:
    with pytest.raises(ValueError, match="`90 degrees` is not a number without a unit or with one of deg, rad, mm, cm, m"):
        arm.joints["elbow joint"].set_position("90 degrees")
    with pytest.raises(ValueError, match="`12mm` does not fit joint `elbow joint`, which turns"):
        arm.set_positions({"elbow joint": "12mm"})
    with pytest.raises(ValueError, match="`12mm` does not fit joint `elbow joint`, which turns"):
        arm.reset_joints({"elbow joint": "12mm"})


def test_an_unknown_name_is_one_error_wherever_it_is_looked_up(sim: Simulation, arm: Robot) -> None:
    state = arm.read()
    for look in (
        lambda: arm.joints["knee"],
        lambda: state["knee"],
        lambda: arm.states(["knee"]),
        lambda: arm.joint_reactions()["knee"],
        lambda: arm.set_positions({"knee": 0.1}),
    ):
        with pytest.raises(simd_client.JointNotFound, match="^[^'].*knee") as refused:
            look()
        assert isinstance(refused.value, KeyError) and refused.value.metadata["joint"] == "knee"
        assert (refused.value.code, refused.value.reason) == ("NOT_FOUND", "JOINT_NOT_FOUND")
    for look in (lambda: sim.robot("leg"), lambda: sim.robots["leg"], lambda: sim.states()["leg"]):
        with pytest.raises(simd_client.RobotNotFound, match="^[^'].*leg") as lost:
            look()
        assert isinstance(lost.value, KeyError) and lost.value.metadata == {"robot": "leg"}
    assert "knee" not in arm.joints and arm.joints.get("knee") is None


def test_a_joint_that_is_a_tendon_has_its_terms(sim: Simulation, tmp_path: Path) -> None:
    file = tmp_path / "finger.xml"
    file.write_text("""<mujoco model='finger'><worldbody><body name='palm'><geom size='.05'/><body name='a'>
        <joint name='knuckle' axis='0 1 0'/><geom size='.02'/><body name='b'><joint name='tip' axis='0 1 0'/>
        <geom size='.02'/></body></body></body></worldbody><tendon><fixed name='pull'><joint joint='tip' coef='-0.01'/>
        <joint joint='knuckle' coef='0.02'/></fixed></tendon><actuator><motor tendon='pull'/></actuator></mujoco>""")
    finger = sim.load(file)
    tendons = {name: joint.info.tendon for name, joint in finger.joints.items()}
    assert tendons == {"knuckle": None, "tip": None, "pull": Tendon({"knuckle": 0.02, "tip": -0.01}, 0.0)}
