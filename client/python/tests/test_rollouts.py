"""Copies of the world run, and their results come as arrays."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from daemon import Daemon

import simd_client
from simd_client import (
    Control,
    Cost,
    Feedback,
    Observation,
    Robot,
    Simulation,
    Start,
    Target,
    Variation,
    aio,
    proto,
)
from simd_client.errors import AnswerError
from simd_client.geometry import FloatArray
from simd_client.rollout_answer import Gathered

JOINTS = ("shoulder joint", "elbow joint")
STEPS = 2000


def test_copies_end_where_the_world_does_with_the_same_targets(sim: Simulation, arm: Robot) -> None:
    tried = np.array([[[0.1, 0.2]], [[0.3, -0.4]], [[0.5, 0.0]]])
    found = sim.rollout(
        STEPS,
        [Control(arm, tried)],
        observe=[Observation("joint_positions", arm), Observation("link_poses", arm, ["forearm"])],
        costs=[
            Cost.joint_positions(arm, JOINTS, (0.3, -0.4), weight=0.0, final_weight=1.0),
            Cost.joint_efforts(arm, weight=0.0),
        ],
    )
    assert sim.stamp.step == 0 and found.start.step == 0
    positions, poses = found.observations
    assert positions.shape == (3, 1, 2) and poses.shape == (3, 1, 1, 7)
    assert found.costs.shape == (3,) and found.terms.shape == (3, 2) and found.step_costs.shape == (3, 0)
    assert found.costs.argmin() == 1 and len(found) == 3
    assert found.steps_done.tolist() == [STEPS] * 3 and found.ended == {}

    arm.set_targets(dict(zip(JOINTS, tried[1, 0].tolist())))
    state = sim.step(STEPS, states=arm)[arm]
    np.testing.assert_array_equal(positions[1, 0], state.position)
    np.testing.assert_array_equal(poses[1, 0, 0, :3], arm.link_poses()["forearm"].position)


def test_rows_are_read_as_often_as_is_asked_and_costs_are_sums_of_steps(sim: Simulation, arm: Robot) -> None:
    found = sim.rollout(
        20,
        [Control(arm, np.full((1, 2), 0.2))],
        observe=[Observation("joint_positions", arm)],
        record_steps=1,
        record_start=True,
        costs=[Cost.joint_positions(arm, weight=2.0, final_weight=3.0)],
        step_costs=True,
    )
    (positions,) = found.observations
    assert positions.shape == (1, 21, 2)
    weights = np.r_[np.full(19, 2.0), 5.0]
    np.testing.assert_allclose(found.step_costs[0], weights * (positions[0, 1:] ** 2).sum(axis=1), rtol=1e-12)
    np.testing.assert_allclose(found.costs, found.step_costs.sum(axis=1), rtol=1e-12)


def test_knots_are_interpolated_and_feedback_closes_a_loop(sim: Simulation, arm: Robot) -> None:
    # Velocities towards a position, in proportion to the distance.
    feedback = Feedback(np.hstack([10.0 * np.eye(2), np.zeros((2, 2))]), [0.5, 0.1, 0.0, 0.0])
    control = Control(arm, mode="velocity", feedback=feedback)
    read = [Observation("joint_positions", arm)]
    held = sim.rollout(1500, [control], starts=[Start(arm, [[0.3, -0.2]])], observe=read)
    np.testing.assert_allclose(held.observations[0][0, 0], [0.5, 0.1], atol=0.01)
    curves = {
        interpolation: sim.rollout(
            30,
            [Control(arm, [[0.0, 0.0], [0.1, 0.1], [0.3, 0.0]], knot_steps=10, interpolation=interpolation)],
            observe=[Observation("joint_positions", arm)],
        ).observations[0]
        for interpolation in ("hold", "linear", "cubic")
    }
    assert not np.array_equal(curves["hold"], curves["linear"])
    assert not np.array_equal(curves["linear"], curves["cubic"])


def test_variations_are_drawn_by_seed_and_given_ones_count_the_copies(sim: Simulation, arm: Robot) -> None:
    def drawn(seed: int) -> FloatArray:
        added = Variation("joint_positions", arm, normal=(0.0, 0.1))
        read = [Observation("joint_positions", arm)]
        return sim.rollout(1, copies=5, variations=[added], observe=read, seed=seed).observations[0]

    np.testing.assert_array_equal(drawn(1), drawn(1))
    assert not np.array_equal(drawn(1), drawn(2))
    masses = Variation("link_masses", arm, ["forearm"], values=[[1.0], [5.0]])
    read = [Observation("joint_positions", arm)]
    loose = Control(arm, [[0.0, 0.0]], mode="effort")
    found = sim.rollout(200, [loose], variations=[masses], observe=read)
    light, heavy = found.observations[0][:, 0]
    assert len(found) == 2 and not np.array_equal(light, heavy)
    forces = [[0.0, 0.0, 0.0], [30.0, 0.0, 0.0]]
    wrench = Variation("wrench", arm, ["forearm"], values=forces, wrench_step=2, wrench_steps=5)
    still, moved = sim.rollout(20, variations=[wrench], observe=read).observations[0]
    assert not np.array_equal(still, moved)


SPINNER = """<robot name="spinner"><link name="base"/><link name="wheel"><inertial><mass value="1"/>
<inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="axle" type="continuous">
<parent link="base"/><child link="wheel"/><axis xyz="0 0 1"/></joint></robot>"""


def test_a_copy_whose_feedback_runs_away_ends_alone(sim: Simulation) -> None:
    spinner = sim.load_text(SPINNER, "spinner", fixed=True)
    # It has no limits: its desired velocity grows with its velocity.
    gains = np.zeros((2, 1, 1, 2))
    gains[1] = -1e6
    control = Control(spinner, mode="velocity", feedback=Feedback(gains))
    found = sim.rollout(
        200,
        [control],
        copies=2,
        starts=[Start(spinner, [0.1])],
        observe=[Observation("joint_positions", spinner)],
        costs=[Cost.joint_positions(spinner)],
    )
    assert list(found.ended) == [1]
    assert 'target of joint "axle" in step' in found.ended[1] and "between -1e12 and 1e12" in found.ended[1]
    assert np.isfinite(found.costs[0]) and np.isinf(found.costs[1])
    assert found.steps_done[0] == 200 and found.steps_done[1] < 200
    assert np.isfinite(found.observations[0][0]).all() and np.isnan(found.observations[0][1]).all()


def test_a_saved_state_is_where_copies_start(sim: Simulation, arm: Robot) -> None:
    saved = sim.save_state("here")
    arm.reset_joints([1.0, 1.0])
    read = [Observation("joint_positions", arm)]
    found = sim.rollout(1, observe=read, saved_state=saved, record_start=True)
    np.testing.assert_array_equal(found.observations[0][0, 0], [0.0, 0.0])


def test_arguments_that_do_not_fit_are_reported(sim: Simulation, arm: Robot) -> None:
    with pytest.raises(ValueError, match="different numbers of copies: 2, 3"):
        sim.rollout(1, [Control(arm, np.zeros((3, 1, 2)))], copies=2)
    with pytest.raises(ValueError, match="the shape"):
        sim.rollout(1, [Control(arm, np.zeros(2))])
    with pytest.raises(ValueError, match="one of"):
        sim.rollout(1, variations=[Variation("gains", arm)])
    with pytest.raises(ValueError, match=r"^steps is -1; give a number from 0 to 4294967295$"):
        sim.rollout(-1)
    with pytest.raises(ValueError, match=r"^there is no interpolation 'round'; give 'hold', 'linear' or 'cubic'$"):
        sim.rollout(1, [Control(arm, [[0.0, 0.0]], interpolation="round")])  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="^there is no observation 'colour'; give 'joint_positions', "):
        sim.rollout(1, observe=[Observation("colour", arm)])  # type: ignore[arg-type]
    with pytest.raises(simd_client.JointNotFound):
        sim.rollout(1, [Control(arm, [[0.0]], ["knee"])])
    with pytest.raises(simd_client.LimitExceeded, match="copies"):
        sim.rollout(1, copies=100_000)
    with pytest.raises(simd_client.InvalidValue, match=r"costs\[0\].weight"):
        sim.rollout(1, costs=[Cost.joint_efforts(arm, weight=1e308), Cost.joint_efforts(arm, weight=-1e308)])
    with pytest.raises(simd_client.InvalidValue, match=r"controls\[0\].values"):
        sim.rollout(1, [Control(arm, [[0.0]])])


def test_progress_is_reported_and_large_arrays_come_whole(sim: Simulation, arm: Robot) -> None:
    heard: list[tuple[int, int]] = []
    read = [Observation("link_poses", arm), Observation("joint_velocities", arm)]
    found = sim.rollout(
        3000, copies=64, observe=read, record_steps=4, progress=lambda done, copies: heard.append((done, copies))
    )
    poses, velocities = found.observations
    assert poses.shape[:2] == (64, 750) and velocities.shape == (64, 750, 2)
    assert np.isfinite(poses).all()
    assert all(0 <= done <= copies == 64 for done, copies in heard)
    np.testing.assert_allclose(np.linalg.norm(poses[..., 3:], axis=-1), 1.0, atol=1e-12)


async def test_asyncio_has_rollouts_too(daemon: Daemon, sim: Simulation, arm: Robot) -> None:
    async with await aio.connect(daemon.endpoint) as other:
        found = await other.rollout(5, [Control("arm", [[0.1, 0.1]])], costs=[Cost.joint_positions("arm")])
        assert found.costs.shape == (1,)


def test_an_answer_that_does_not_fit_is_refused() -> None:
    result = proto.RolloutResult(copies=2, rows=1, widths=[3], steps_done=[1, 1])
    gathered = Gathered(result)
    with pytest.raises(AnswerError):
        gathered.add(proto.RolloutPart(array=proto.RolloutArray.ROLLOUT_ARRAY_COSTS, data=bytes(8)))
    with pytest.raises(AnswerError):
        gathered.add(proto.RolloutPart(array=proto.RolloutArray.ROLLOUT_ARRAY_STATES, data=bytes(7)))
    with pytest.raises(AnswerError):
        Gathered(proto.RolloutResult(copies=2**31, rows=2**20, widths=[2**20]))
    assert not gathered.is_whole


def test_environments_are_reset_by_the_step_after_they_ended(sim: Simulation, arm: Robot) -> None:
    pytest.importorskip("gymnasium")
    from simd_client.gymnasium import RolloutEnv

    envs = RolloutEnv(
        sim, arm, copies=4, limit=2.0, steps=5, episode=3, costs=[Cost.joint_positions(arm)], spread=0.1
    )
    first, _ = envs.reset(seed=7)
    assert first.shape == (4, 4) and first in envs.observation_space
    again, _ = envs.reset(seed=7)
    np.testing.assert_array_equal(first, again)
    observations = first
    for turn in range(3):
        observations, rewards, terminated, truncated, _ = envs.step(np.full((4, 2), 0.5))
        assert (rewards < 0).all() and not terminated.any()
        assert truncated.all() == (turn == 2)
    reset, rewards, _, truncated, _ = envs.step(np.zeros((4, 2)))
    assert (rewards == 0).all() and not truncated.any()
    assert not np.array_equal(reset, observations)
    np.testing.assert_allclose(reset, first, atol=1.0)


def test_each_environment_begins_by_its_own_seed_where_there_is_one_for_each(sim: Simulation, arm: Robot) -> None:
    pytest.importorskip("gymnasium")
    from simd_client.gymnasium import RolloutEnv

    envs = RolloutEnv(sim, arm, copies=3, limit=2.0, steps=2, episode=1, spread=0.1)
    first, _ = envs.reset(seed=[1, 2, 3])
    turned, _ = envs.reset(seed=[3, 2, 7])
    np.testing.assert_array_equal(turned[:2], first[[2, 1]])
    assert not np.array_equal(turned[2], first[0])
    # Draws after the first episode come from the same sources.
    ends: list[FloatArray] = []
    for seeds in ([1, 2, 3], [3, 2, 1]):
        envs.reset(seed=seeds)
        envs.step(np.zeros((3, 2)))
        ends.append(envs.step(np.zeros((3, 2)))[0])
    np.testing.assert_array_equal(ends[0], ends[1][::-1])
    assert np.isfinite(envs.reset(seed=[1, None, 3])[0]).all()
    with pytest.raises(ValueError, match="^there are 2 seeds for 3 environments$"):
        envs.reset(seed=[1, 2])


def test_environments_differ_by_their_variations_which_a_reset_draws(sim: Simulation, arm: Robot) -> None:
    pytest.importorskip("gymnasium")
    from simd_client.gymnasium import RolloutEnv

    masses = Variation("link_masses", arm, uniform=(0.2, 5.0))
    envs = RolloutEnv(sim, arm, copies=3, limit=2.0, steps=50, variations=[masses])

    def ends(seed: int | None) -> FloatArray:
        envs.reset(seed=seed)
        return envs.step(np.full((3, 2), 0.5))[0]

    first = ends(7)
    assert len(np.unique(first[:, 0])) == 3, "all begin alike, and have other masses"
    np.testing.assert_array_equal(ends(7), first)
    assert not np.array_equal(ends(8), first)
    assert not np.array_equal(ends(None), ends(None)), "each reset draws"
    with pytest.raises(ValueError, match="joint_positions would be added at each action: `spread`"):
        RolloutEnv(sim, arm, copies=3, variations=[Variation("joint_positions", arm, normal=(0.0, 0.1))])


def test_an_environment_of_a_robot_that_is_free_and_ends_where_it_is_asked_to(sim: Simulation) -> None:
    pytest.importorskip("gymnasium")
    from simd_client.gymnasium import RolloutEnv

    gripper = Path(__file__).parents[1] / "examples" / "robots" / "gripper.urdf"
    robot = sim.load(gripper, "free", fixed=False, position=(0, 0, 2))
    envs = RolloutEnv(
        sim, robot, copies=2, mode="position", limit=0.01, steps=10,
        reward=lambda observations, actions: observations[:, -4],
        is_over=lambda observations: observations[:, -11] < 1.999,
    )  # fmt: skip
    envs.reset(seed=1)
    size = 2 * len(robot.joint_names) + 13
    ends: list[bool] = []
    for _ in range(4):
        observations, _, terminated, _, _ = envs.step(np.zeros(envs.action_space.shape or ()))
        assert observations.shape == (2, size)
        ends.append(bool(terminated.all()))
    # It falls by 1 mm in 14 ms: in the second action, and is reset by the third.
    assert ends == [False, True, False, False]


def test_targets_in_the_world_are_left_as_they_are(sim: Simulation, arm: Robot) -> None:
    arm.set_targets({JOINTS[0]: Target.position(0.4)})
    sim.rollout(10, [Control(arm, [[1.0, 1.0]])])
    assert sim.states(arm)[arm].target[0] == 0.4
