"""Environments of gymnasium: ids, any robot, many copies, pictures."""

from __future__ import annotations

import shutil
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from daemon import ASSETS, BINARY

from simd_client import NoRenderer, SensorNotFound, embedded_link
from simd_client.geometry import FloatArray

gymnasium: Any = pytest.importorskip("gymnasium")
checker: Any = pytest.importorskip("gymnasium.utils.env_checker")

import simd_client.gymnasium as environments  # noqa: E402

RobotEnv, RobotVectorEnv = environments.RobotEnv, environments.RobotVectorEnv
IDS = list(environments.TASKS)
ARM = ASSETS / "seven_arm"

pytestmark = pytest.mark.skipif(not embedded_link.is_installed(), reason="simd-embedded is not installed")


@pytest.fixture
def opened() -> Iterator[list[Any]]:
    """Environments that the test's end closes."""
    found: list[Any] = []
    yield found
    for each in found:
        each.close()


def check(test: Any, env: Any) -> None:
    with warnings.catch_warnings():
        # An observation of a velocity has no bounds.
        warnings.filterwarnings("ignore", message=".*A Box observation space (min|max)imum value is -?infinity.*")
        test(env)


def checked(env: Any) -> None:
    checker.check_env(env, skip_render_check=True)


def near_zero(states: FloatArray, actions: FloatArray) -> FloatArray:
    return -np.abs(states[..., :7]).sum(axis=-1)


@pytest.mark.parametrize("name", IDS)
def test_an_id_makes_an_environment_that_gymnasium_accepts(name: str, opened: list[Any]) -> None:
    env = gymnasium.make(name)
    opened.append(env)
    assert env.spec.max_episode_steps == environments.TASKS[name].max_episode_steps
    check(checked, env.unwrapped)


def test_an_id_may_name_the_module_that_registers_it(opened: list[Any]) -> None:
    # So it is made in processes that have not imported the module, as RLlib's.
    opened.append(gymnasium.make("simd_client.gymnasium:simd/CartPole-v0"))


@pytest.mark.parametrize("name", IDS)
def test_stable_baselines3_accepts_it(name: str, opened: list[Any]) -> None:
    baselines: Any = pytest.importorskip("stable_baselines3.common.env_checker")
    env = gymnasium.make(name)
    opened.append(env)
    check(baselines.check_env, env.unwrapped)


@pytest.mark.parametrize("name", IDS)
def test_equal_seeds_and_actions_give_equal_bits(name: str, opened: list[Any]) -> None:
    runs: list[list[Any]] = []
    for _ in range(2):
        env = gymnasium.make(name)
        opened.append(env)
        env.action_space.seed(3)
        seen: list[Any] = [env.reset(seed=7)[0]]
        # The second episode begins elsewhere, but the same in both runs.
        for reset in (False, True):
            if reset:
                seen.append(env.reset()[0])
            seen += [env.step(env.action_space.sample())[0] for _ in range(5)]
        runs.append(seen)
    np.testing.assert_array_equal(runs[0], runs[1])
    assert (runs[0][0] != runs[0][6]).any()


@pytest.mark.parametrize("name", ["simd/CartPole-v0", "simd/Reacher-v0"])
def test_each_of_many_environments_has_the_bits_of_one(name: str, opened: list[Any]) -> None:
    envs = gymnasium.make_vec(name, num_envs=3)
    opened.append(envs)
    assert isinstance(envs, RobotVectorEnv) and envs.single_action_space == gymnasium.make(name).action_space
    size = 1 if name == "simd/CartPole-v0" else 2
    actions = np.random.default_rng(1).uniform(-1.5, 1.5, (8, 3, size)).astype(np.float32)
    seen, gained = [envs.reset(seed=5)[0]], []
    for each in actions:
        observations, rewards, _, _, _ = envs.step(each)
        seen.append(observations)
        gained.append(rewards)
    for index in range(3):
        env = RobotEnv(name)
        opened.append(env)
        np.testing.assert_array_equal(env.reset(seed=5 + index)[0], seen[0][index])
        for turn, each in enumerate(actions):
            observation, reward, _, _, _ = env.step(each[index])
            np.testing.assert_array_equal(observation, seen[turn + 1][index])
            assert reward == gained[turn][index]


def test_a_quadruped_stands_in_one_environment_as_in_many(opened: list[Any]) -> None:
    env, envs = gymnasium.make("simd/Quadruped-v0"), gymnasium.make_vec("simd/Quadruped-v0", num_envs=2)
    opened += [env, envs]
    one, many = env.reset(seed=1)[0], envs.reset(seed=1)[0]
    np.testing.assert_array_equal(one, many[0])
    nothing = np.zeros((2, 12), dtype=np.float32)
    for _ in range(50):
        one, _, over, _, _ = env.step(nothing[0])
        many, _, overs, _, _ = envs.step(nothing)
        assert not over and not overs.any()
    assert one[24] == pytest.approx(0.29, abs=0.02) and many[:, 24] == pytest.approx(0.29, abs=0.02)


def test_episodes_end_and_begin_again(opened: list[Any]) -> None:
    envs = gymnasium.make_vec("simd/CartPole-v0", num_envs=4, max_episode_steps=6)
    envs = gymnasium.wrappers.vector.RecordEpisodeStatistics(envs)
    opened.append(envs)
    first, _ = envs.reset(seed=0)
    _, _, terminated, truncated, info = [envs.step(np.zeros((4, 1), dtype=np.float32)) for _ in range(6)][-1]
    assert truncated.all() and not terminated.any() and info["episode"]["l"].tolist() == [6] * 4
    begun, rewards, _, truncated, _ = envs.step(np.zeros((4, 1), dtype=np.float32))
    assert not truncated.any() and not rewards.any() and (np.abs(begun) < 0.2).all() and (begun != first).any()
    # A falling pole ends the episode of one environment only.
    env = gymnasium.make("simd/CartPole-v0")
    opened.append(env)
    env.reset(seed=0)
    steps = 0
    while not env.step(np.ones(1, dtype=np.float32))[2]:
        steps += 1
    assert 0 < steps < 100


def test_any_robot_has_spaces_of_its_joints(opened: list[Any]) -> None:
    env = RobotEnv(ARM, fixed=True, mode="position", max_episode_steps=3, reward=near_zero)
    opened.append(env)
    check(checked, env)
    assert env.observation_space.shape == (14,) and env.action_space.shape == (7,)
    observation, _ = env.reset(seed=1)
    assert not observation.any()
    # Half of the way between the limits of each joint.
    limits = [joint.limits for joint in env.sim.robots["robot"].layout.moving]
    middle = [0.5 * (each.lower + each.upper) for each in limits]
    done = [env.step(np.zeros(7, dtype=np.float32)) for _ in range(3)]
    observation, reward, *_ = done[-1]
    assert [each[2:4] for each in done] == [(False, False), (False, False), (False, True)] and reward == -np.abs(observation[:7]).sum()
    assert env.sim.robots["robot"].target == pytest.approx(middle)


def test_actions_drive_named_joints_between_bounds(opened: list[Any]) -> None:
    env = RobotEnv(ARM, fixed=True, joints=["joint_2", "joint_1"], low=-2.0, high=[4.0, 3.0], frame_skip=1)
    opened.append(env)
    env.reset(seed=1)
    env.step(np.array([1.0, -9.0], dtype=np.float32))
    state = env.sim.robots["robot"].read()
    assert (state["joint_2"].target, state["joint_1"].target) == (4.0, -2.0)


IMU = """<robot name="box"><link name="base"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="tip"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="turn" type="continuous"><parent link="base"/><child link="tip"/><axis xyz="0 0 1"/>
<limit effort="5" velocity="9"/></joint>
<gazebo reference="tip"><sensor name="imu" type="imu"><update_rate>500</update_rate></sensor></gazebo></robot>"""


def test_readings_of_sensors_are_observed(tmp_path: Path, opened: list[Any]) -> None:
    (tmp_path / "box.urdf").write_text(IMU)
    env = RobotEnv(tmp_path / "box.urdf", fixed=True, sensors=("imu",))
    opened.append(env)
    observation, _ = env.reset(seed=1)
    assert observation.shape == (12,) and not observation.any()
    observation, *_ = env.step(np.ones(1, dtype=np.float32))
    # Acceleration, angular velocity, and a quaternion: at rest except for its turn about z.
    np.testing.assert_allclose(observation[2:5], (0.0, 0.0, 9.81), atol=1e-6)
    assert observation[7] == pytest.approx(observation[1], abs=0.02) and observation[7] > 0.0
    assert np.linalg.norm(observation[8:]) == pytest.approx(1.0)
    with pytest.raises(SensorNotFound, match="no sensor `eye`"):
        RobotEnv(tmp_path / "box.urdf", fixed=True, sensors=("eye",))


def test_mistakes_are_said_in_a_sentence() -> None:
    with pytest.raises(ValueError, match="no joint `joint_9` of one axis; it has joint_1, joint_2"):
        RobotEnv(ARM, fixed=True, joints=["joint_9"])
    with pytest.raises(ValueError, match="is not below high"):
        RobotEnv(ARM, fixed=True, low=1.0, high=0.5)
    with pytest.raises(ValueError, match="each is above 0"):
        RobotEnv(ARM, fixed=True, frame_skip=0)
    with pytest.raises(ValueError, match="render_mode='human' is not there"):
        RobotEnv(ARM, fixed=True, render_mode="human")
    with pytest.raises(ValueError, match="draws no pictures"):
        RobotVectorEnv(ARM, 2, fixed=True, render_mode="rgb_array")
    with pytest.raises(TypeError, match="frameskip"):
        RobotEnv(ARM, fixed=True, frameskip=3)


def test_processes_have_a_world_each() -> None:
    with warnings.catch_warnings():
        # A fork of a process with threads; its child opens a new world.
        warnings.filterwarnings("ignore", category=DeprecationWarning)
        envs = gymnasium.make_vec("simd/CartPole-v0", num_envs=2, vectorization_mode="async", vector_kwargs={"context": "spawn"})
    try:
        many = envs.reset(seed=5)[0]
    finally:
        envs.close()
    for index in range(2):
        env = RobotEnv("simd/CartPole-v0")
        np.testing.assert_array_equal(env.reset(seed=5 + index)[0], many[index])
        env.close()


def has_renderer() -> bool:
    return BINARY.with_name("simd-camera").is_file() and any(Path("/usr/share/vulkan/icd.d").glob("*.json"))


@pytest.mark.skipif(not has_renderer(), reason="there is no renderer: make camera, make vulkan")
def test_pictures_are_drawn(monkeypatch: pytest.MonkeyPatch, opened: list[Any]) -> None:
    monkeypatch.setenv("SIMD_CAMERA", str(BINARY.resolve().with_name("simd-camera")))
    env = gymnasium.make("simd/Quadruped-v0", render_mode="rgb_array")
    opened.append(env)
    env.reset(seed=1)
    first = env.render()
    assert first.shape == (360, 480, 3) and first.dtype == np.uint8 and np.ptp(first) > 50
    for _ in range(10):
        env.step(np.ones(12, dtype=np.float32))
    assert (env.render() != first).any()


def test_without_a_renderer_the_error_says_what_to_do(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, opened: list[Any]
) -> None:
    monkeypatch.delenv("SIMD_CAMERA", raising=False)
    monkeypatch.delenv("SIMD_BINARY", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    if shutil.which("simd-camera") is not None:
        pytest.skip("a renderer is there")
    env = RobotEnv("simd/CartPole-v0", render_mode="rgb_array")
    opened.append(env)
    env.reset(seed=1)
    with pytest.raises(NoRenderer, match="SIMD_CAMERA"):
        env.render()
