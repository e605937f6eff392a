"""Independent ROS 2 tools see the daemon: zenoh-ros2-sdk's nodes and rosbags' types, at a router of Zenoh.

The process has one session of zenoh-ros2-sdk, and one router.
"""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import zenoh
from daemon import ASSETS, Daemon, within
from renderer import EYE, rendering
from ros2_graph import SECONDS, Graph, make_ros2

import simd_client
from simd_client import ForceTorqueSensor, ImuSensor, LidarSensor, Pose, RangeSensor, SensorNoise, Simulation, Sweep

qos = pytest.importorskip("zenoh_ros2_sdk.qos")


@pytest.fixture(scope="module")
def graph() -> Iterator[Graph]:
    graph = Graph()
    yield graph
    graph.session.session.close()
    graph.router.close()


@pytest.fixture
def daemon(graph: Graph, tmp_path: Path) -> Iterator[Daemon]:
    config = tmp_path / "simd.toml"
    config.write_text(f'[ros2]\nenabled = true\nrouter = "tcp/127.0.0.1:{graph.port}"\n')
    with Daemon("--config", str(config), "--asset-root", str(ASSETS), name="driver") as running:
        yield running
        assert running.stop() == 0


@pytest.fixture
def sim(daemon: Daemon) -> Iterator[Simulation]:
    with simd_client.connect(daemon.endpoint) as connected:
        yield connected


def test_a_foreign_subscriber_gets_joints_time_frames_and_the_description(graph: Graph, sim: Simulation) -> None:
    arm = sim.load(ASSETS / "seven_arm", "arm", fixed=True)
    states = graph.messages("/joint_states", "sensor_msgs/msg/JointState")
    state = states.until(lambda message: len(message.name) == 7)
    assert list(state.name) == list(arm.joints)
    assert len(state.position) == len(state.velocity) == len(state.effort) == 7
    arm.joints[3].target = 0.4
    states.until(lambda message: abs(message.position[3] - 0.4) < 0.01)

    clock = graph.messages("/clock", "rosgraph_msgs/msg/Clock")
    first = clock.until(lambda message: True).clock
    clock.until(lambda message: (message.clock.sec, message.clock.nanosec) > (first.sec, first.nanosec))

    moving = graph.messages("/tf", "tf2_msgs/msg/TFMessage").until(lambda message: len(message.transforms) == 7)
    assert moving.transforms[0].child_frame_id == arm.joints[0].info.child_link

    latched = qos.QosProfile(durability=qos.QosDurability.TRANSIENT_LOCAL, history_depth=1)
    text = graph.messages("/robot_description", "std_msgs/msg/String", qos=latched).until(lambda message: True)
    assert text.data == (ASSETS / "seven_arm" / "urdf" / "seven_arm.urdf").read_text()
    fixed = graph.messages("/tf_static", "tf2_msgs/msg/TFMessage", qos=latched)
    assert fixed.until(lambda message: message.transforms).transforms[0].header.frame_id == "world"


def test_a_foreign_subscriber_gets_each_reading_of_sensors(graph: Graph, sim: Simulation) -> None:
    np = make_ros2.np
    arm = sim.load(ASSETS / "seven_arm", "arm", fixed=True)
    sim.add_box((1, 10, 10), name="wall", position=(4.5, 0, 0), fixed=True)
    ahead = Pose.of((1, 0, 3))
    noise = [SensorNoise("angular_velocity", 0.1)]
    arm.sensors.create(ImuSensor(), "imu", rate=500, noise=noise)
    arm.sensors.create(ForceTorqueSensor("sensor"), "wrist", joint=arm.joints[5].name)
    arm.sensors.create(RangeSensor(0.1, 10.0), "ray", rate=20, pose=ahead)
    arm.sensors.create(LidarSensor(0.1, 10.0, Sweep(3, -0.5, 0.5)), "line", rate=20, pose=ahead)
    arm.sensors.create(LidarSensor(0.1, 10.0, Sweep(3, -0.5, 0.5), Sweep(2, 0.0, 0.1)), "cloud", rate=20, pose=ahead)

    imu = graph.messages("/sensors/imu", "sensor_msgs/msg/Imu")
    readings = [imu.until(lambda message: True) for _ in range(200)]
    assert readings[0].header.frame_id == "imu" and abs(readings[0].linear_acceleration.z - 9.81) < 1e-6
    assert list(readings[0].angular_velocity_covariance) == pytest.approx([0.01, 0, 0, 0, 0.01, 0, 0, 0, 0.01])
    times = np.array([each.header.stamp.sec + each.header.stamp.nanosec * 1e-9 for each in readings])
    # Five hundred a second, in order, each once; Zenoh drops messages that a receiver is too slow for.
    periods = np.diff(times) / 0.002
    assert np.allclose(periods, np.round(periods), atol=1e-5) and periods.min() > 0.5
    assert (periods < 1.5).mean() > 0.8

    wrist = graph.messages("/sensors/wrist", "geometry_msgs/msg/WrenchStamped").until(lambda message: True)
    assert wrist.header.frame_id == "wrist" and np.isfinite(wrist.wrench.force.z)
    ray = graph.messages("/sensors/ray", "sensor_msgs/msg/Range").until(lambda message: True)
    assert (ray.range, ray.max_range) == pytest.approx((3.0, 10.0), abs=1e-5)
    line = graph.messages("/sensors/line", "sensor_msgs/msg/LaserScan").until(lambda message: True)
    assert line.ranges == pytest.approx([3.0 / np.cos(0.5), 3.0, 3.0 / np.cos(0.5)], abs=1e-5)
    assert line.angle_min + 2 * line.angle_increment == pytest.approx(line.angle_max)
    cloud = graph.messages("/sensors/cloud", "sensor_msgs/msg/PointCloud2").until(lambda message: True)
    points = np.frombuffer(bytes(cloud.data), dtype="<f4").reshape(cloud.height, cloud.width, 3)
    assert points.shape == (2, 3, 3) and [field.name for field in cloud.fields] == ["x", "y", "z"]
    assert np.allclose(points[..., 0], 3.0, atol=1e-5) and np.allclose(points[1, 1], (3.0, 0.0, 3.0 * np.tan(0.1)), atol=1e-5)

    latched = qos.QosProfile(durability=qos.QosDurability.TRANSIENT_LOCAL, history_depth=1)
    fixed = graph.messages("/tf_static", "tf2_msgs/msg/TFMessage", qos=latched)
    frames = fixed.until(lambda message: any(each.child_frame_id == "cloud" for each in message.transforms))
    (placed,) = [each for each in frames.transforms if each.child_frame_id == "cloud"]
    assert (placed.transform.translation.x, placed.transform.translation.z) == (1.0, 3.0)


def test_a_foreign_subscriber_gets_the_pictures_of_a_camera(graph: Graph, daemon: Daemon, sim: Simulation) -> None:
    np = make_ros2.np
    sim.load(ASSETS / "seven_arm", "arm", fixed=True).sensors.create(EYE, "eye", rate=50)
    with rendering(daemon):
        images = graph.messages("/sensors/eye/image_raw", "sensor_msgs/msg/Image")
        depths = graph.messages("/sensors/eye/depth/image_raw", "sensor_msgs/msg/Image")
        infos = graph.messages("/sensors/eye/camera_info", "sensor_msgs/msg/CameraInfo")
        image = images.until(lambda message: True)
        assert (image.header.frame_id, image.encoding) == ("eye_optical", "rgb8")
        assert (image.width, image.height, image.step, len(image.data)) == (4, 3, 12, 36)
        # A thousand steps a second; the renderer draws their number.
        step = round((image.header.stamp.sec + image.header.stamp.nanosec * 1e-9) * 1000)
        assert set(bytes(image.data)) == {step % 256}
        depth = depths.until(lambda message: True)
        assert depth.encoding == "32FC1" and len(depth.data) == 48
        step = round((depth.header.stamp.sec + depth.header.stamp.nanosec * 1e-9) * 1000)
        assert (np.frombuffer(bytes(depth.data), "<f4") == step).all()
        info = infos.until(lambda message: True)
    focal = 2.0 / np.tan(0.6)
    assert list(info.k) == pytest.approx([focal, 0, 1.5, 0, focal, 1, 0, 0, 1])
    assert (info.width, info.height, info.distortion_model) == (4, 3, "plumb_bob")


def test_commands_of_a_foreign_publisher_move_joints_unless_another_client_claims_them(
    graph: Graph, sim: Simulation
) -> None:
    arm = sim.load(ASSETS / "seven_arm", "arm", fixed=True)
    states = graph.messages("/joint_states", "sensor_msgs/msg/JointState")
    states.until(lambda message: len(message.name) == 7)
    layout = graph.make("std_msgs/msg/MultiArrayLayout")
    positions = graph.publisher("/forward_position_controller/commands", "std_msgs/msg/Float64MultiArray")
    wanted = [0.1, -0.2, 0.3, -0.4, 0.2, -0.1, 0.05]
    np = make_ros2.np
    positions.publish(layout=layout, data=np.array(wanted))
    states.until(lambda message: np.allclose(message.position, wanted, atol=0.01))
    # First another number of joints, then nonsense: both are refused, and the next one holds.
    positions.publish(layout=layout, data=np.array([0.5]))
    positions.publish(layout=layout, data=np.array([np.nan] * 7))
    by_name = graph.publisher("/joint_commands", "sensor_msgs/msg/JointState")
    header = graph.make("std_msgs/msg/Header")
    none = np.array([])
    by_name.publish(
        header=header, name=[arm.joints[0].name], position=np.array([0.6]), velocity=none, effort=none
    )
    state = states.until(lambda message: abs(message.position[0] - 0.6) < 0.01)
    assert abs(state.position[1] + 0.2) < 0.01
    with arm.claim():
        positions.publish(layout=layout, data=np.zeros(7))
        before = state.header.stamp.sec
        state = states.until(lambda message: message.header.stamp.sec > before)
        assert abs(state.position[0] - 0.6) < 0.01


def reach(graph: Graph, joints: list[str], goal: list[float], seconds: int) -> Any:
    """From rest to rest."""
    np = make_ros2.np
    at = graph.make("builtin_interfaces/msg/Duration", sec=seconds)
    zeros = np.zeros(len(joints))
    point = graph.make(
        "trajectory_msgs/msg/JointTrajectoryPoint",
        positions=np.array(goal),
        velocities=zeros,
        accelerations=zeros,
        time_from_start=at,
    )
    return graph.make("trajectory_msgs/msg/JointTrajectory", joint_names=joints, points=[point])


def test_a_trajectory_of_a_foreign_publisher_is_carried_out(graph: Graph, sim: Simulation) -> None:
    arm = sim.load(ASSETS / "seven_arm", "arm", fixed=True)
    states = graph.messages("/joint_states", "sensor_msgs/msg/JointState")
    states.until(lambda message: len(message.name) == 7)
    goal = [0.1, -0.2, 0.3, -0.4, 0.2, -0.1, 0.05]
    wanted = reach(graph, list(arm.joints), goal, 1)
    topic = "/joint_trajectory_controller/joint_trajectory"
    publisher = graph.publisher(topic, "trajectory_msgs/msg/JointTrajectory")
    events = sim.events()
    publisher.publish(header=wanted.header, joint_names=wanted.joint_names, points=wanted.points)
    states.until(lambda message: make_ros2.np.allclose(message.position, goal, atol=0.01))
    ended = next(event for event in events if event.kind == "trajectory_ended")
    assert ended.detail.message == "the goal is reached"


def test_the_action_takes_goals_cancels_them_and_reports_their_results(graph: Graph, sim: Simulation) -> None:
    arm = sim.load(ASSETS / "seven_arm", "arm", fixed=True)
    joints = list(arm.joints)
    action = "joint_trajectory_controller/follow_joint_trajectory/_action"
    kind = "control_msgs/action/FollowJointTrajectory"
    wait_for(lambda: any(f"/SS/%/%/driver/%{action.replace('/', '%')}%send_goal/" in token for token in graph.tokens()))

    def send(number: int, trajectory: Any, **fields: Any) -> tuple[Any, bool]:
        identifier = graph.make("unique_identifier_msgs/msg/UUID", uuid=make_ros2.np.full(16, number, "uint8"))
        goal = graph.make(f"{kind}_Goal", trajectory=trajectory, **fields)
        request = graph.make(f"{kind}_SendGoal_Request", goal_id=identifier, goal=goal)
        return identifier, graph.ask(f"{action}/send_goal", f"{kind}_SendGoal", request).accepted

    def result(identifier: Any) -> tuple[int, int, str]:
        request = graph.make(f"{kind}_GetResult_Request", goal_id=identifier)
        answer = graph.ask(f"{action}/get_result", f"{kind}_GetResult", request)
        return answer.status, answer.result.error_code, answer.result.error_string

    feedback = graph.messages(f"/{action}/feedback", f"{kind}_FeedbackMessage")
    first, accepted = send(1, reach(graph, joints, [0.2] * 7, 1))
    assert accepted
    heard = feedback.until(lambda message: message.feedback.actual.positions[0] > 0.05)
    assert list(heard.feedback.joint_names) == joints and bytes(heard.goal_id.uuid) == bytes([1] * 16)
    assert result(first) == (4, 0, "the goal is reached")

    second, accepted = send(2, reach(graph, joints, [-0.2] * 7, 1000))
    assert accepted
    cancel = graph.make("action_msgs/srv/CancelGoal_Request")
    cancel.goal_info.goal_id = second
    cancelled = graph.ask(f"{action}/cancel_goal", "action_msgs/srv/CancelGoal", cancel)
    assert cancelled.return_code == 0 and len(cancelled.goals_canceling) == 1
    assert result(second)[0] == 5
    assert graph.ask(f"{action}/cancel_goal", "action_msgs/srv/CancelGoal", cancel).return_code == 3

    tolerance = graph.make("control_msgs/msg/JointTolerance", name=joints[0], position=1e-9)
    third, accepted = send(3, reach(graph, joints, [1.0] * 7, 1), path_tolerance=[tolerance])
    assert accepted
    status, code, message = result(third)
    assert (status, code) == (6, -4) and joints[0] in message
    assert not send(4, reach(graph, ["ghost"], [1.0], 1))[1]
    unknown = graph.make("unique_identifier_msgs/msg/UUID", uuid=make_ros2.np.full(16, 9, "uint8"))
    assert result(unknown)[0] == 0


def wait_for(fits: Callable[[], bool]) -> None:
    deadline = within(SECONDS)
    while not fits():
        assert time.monotonic() < deadline


def test_topics_keep_their_names_while_other_robots_come_and_go(graph: Graph, sim: Simulation) -> None:
    def seen(count: int) -> list[str]:
        deadline = within(SECONDS)
        while True:
            tokens = [token for token in graph.tokens() if "/%/driver" in token]
            found = [token for token in tokens if "joint_states" in token]
            if len(found) == count:
                return tokens
            assert time.monotonic() < deadline, tokens

    seen(0)
    left = sim.load(ASSETS / "seven_arm", "left", fixed=True)
    seen(1)

    def has(kind: str, part: str) -> Callable[[], bool]:
        return lambda: any(f"/{kind}/" in token and part in token for token in graph.tokens())

    # They come one after another.
    for kind, part in [("NN", ""), ("SS", "get_entities"), ("MS", "%forward_position_controller%commands")]:
        wait_for(has(kind, part))
    sim.load(ASSETS / "seven_arm", "right", fixed=True)

    def joint_states(count: int) -> list[str]:
        return sorted(token.split("/")[9] for token in seen(count) if "joint_states" in token)

    assert joint_states(2) == ["%joint_states", "%right%joint_states"]
    states = graph.messages("/joint_states", "sensor_msgs/msg/JointState")
    before = states.until(lambda message: True).header.stamp
    sim.load(ASSETS / "seven_arm", "third", fixed=True).delete()
    states.until(lambda message: message.header.stamp.sec > before.sec + 1)
    left.delete()
    assert joint_states(1) == ["%right%joint_states"]


def test_simulation_interfaces_are_served_to_a_foreign_client(graph: Graph, sim: Simulation) -> None:
    si = "simulation_interfaces/msg"
    features = graph.call("/get_simulator_features", "GetSimulatorFeatures", structure_needs_at_least_one_member=0)
    assert "urdf" in features.features.spawn_formats
    urdf = "<robot name='box'><link name='body'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link></robot>"
    pose = graph.make("geometry_msgs/msg/PoseStamped")
    pose.pose.position.z = 2.0
    spawned = graph.call(
        "/spawn_entity",
        "SpawnEntity",
        name="box",
        allow_renaming=False,
        entity_resource=graph.make(f"{si}/Resource", resource_string=urdf),
        entity_namespace="",
        initial_pose=pose,
    )
    assert (spawned.result.result, spawned.entity_name) == (1, "box"), spawned.result.error_message
    entities = graph.call("/get_entities", "GetEntities", filters=graph.make(f"{si}/EntityFilters"))
    assert entities.entities == ["box"]

    paused = graph.make(f"{si}/SimulationState", state=2)
    assert graph.call("/set_simulation_state", "SetSimulationState", state=paused).result.result == 1
    now = graph.call("/get_simulation_state", "GetSimulationState", structure_needs_at_least_one_member=0)
    assert now.state.state == 2
    state = graph.make(f"{si}/EntityState")
    state.pose.position.z = 5.0
    state.pose.orientation.w = 1.0
    moved = graph.call(
        "/set_entity_state",
        "SetEntityState",
        entity="box",
        state=state,
        set_pose=True,
        set_twist=True,
        set_acceleration=False,
    )
    assert moved.result.result == 1, moved.result.error_message
    before = sim.stamp.sim_time
    assert graph.call("/step_simulation", "StepSimulation", steps=100).result.result == 1
    assert abs(sim.stamp.sim_time - before - 0.1) < 1e-9
    there = graph.call("/get_entity_state", "GetEntityState", entity="box").state
    # Free fall for a tenth of a second.
    assert abs(there.pose.position.z - (5.0 - 0.5 * 9.81 * 0.01)) < 1e-4
    assert graph.call("/get_entity_state", "GetEntityState", entity="ghost").result.result == 2
    assert graph.call("/delete_entity", "DeleteEntity", entity="box").result.result == 1
    assert graph.call("/reset_simulation", "ResetSimulation", scope=255).result.result == 1
    assert sim.stamp.sim_time == 0.0


def test_a_daemon_whose_router_is_not_there_yet_serves_and_joins_once_it_is(tmp_path: Path) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    config = tmp_path / "simd.toml"
    config.write_text(f'[ros2]\nenabled = true\nrouter = "tcp/127.0.0.1:{port}"\n')
    with Daemon("--config", str(config), name="patient") as running:
        with simd_client.connect(running.endpoint) as sim:
            assert sim.stamp.sim_time >= 0.0
        for _ in range(2):
            seen = threading.Event()
            settings = zenoh.Config()
            settings.insert_json5("mode", '"router"')
            settings.insert_json5("listen/endpoints", f'["tcp/127.0.0.1:{port}"]')
            settings.insert_json5("scouting/multicast/enabled", "false")
            opened: Any = zenoh.open(settings)
            with opened as router:

                def came(_: Any, seen: threading.Event = seen) -> None:
                    seen.set()

                token: Any = router.liveliness().declare_subscriber("@ros2_lv/0/*/*/*/NN/**", came, history=True)
                assert seen.wait(SECONDS), "the node is on the graph of a router that came late, or again"
                token.undeclare()
        assert running.stop() == 0
