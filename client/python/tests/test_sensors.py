"""Sensors."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from daemon import Daemon

import simd_client
from simd_client import (
    CameraSensor,
    ContactSensor,
    EncoderSensor,
    ForceTorqueSensor,
    ImuSensor,
    LidarSensor,
    LinkStateSensor,
    OdometrySensor,
    Pose,
    RangeSensor,
    Robot,
    SensorNoise,
    Simulation,
    Sweep,
    aio,
    proto,
)
from simd_client.measurement import readings_from_proto

G = 9.81


def test_a_sensor_is_made_listed_read_and_deleted(sim: Simulation, arm: Robot) -> None:
    imu = arm.sensors.create(ImuSensor())
    encoder = arm.sensors.create(EncoderSensor(backlash=0.001), "elbow", joint="elbow joint", rate=100, seed=7)
    assert (imu.name, encoder.name) == ("imu_1", "elbow")
    with pytest.raises(simd_client.NoReading):
        imu.read()
    begin = imu.info().last_sequence
    sim.step(25)
    reading = imu.read()
    assert (reading.sequence - begin, reading.sample, reading.stamp.step) == (25, 25, 25)
    # The arm is bolted to the world.
    assert reading.measurement.linear_acceleration == pytest.approx([0, 0, G], abs=1e-9)
    assert reading.measurement.orientation == pytest.approx([0, 0, 0, 1])
    assert encoder.read().stamp.step == 20
    assert encoder.read().measurement.position == pytest.approx(arm.joints["elbow joint"].position, abs=1e-2)
    first, second = arm.sensors.list()
    assert (first.kind, second.kind, second.joint, second.rate, second.seed) == (
        ImuSensor(), EncoderSensor(0.001), "elbow joint", 100.0, 7,
    )  # fmt: skip
    assert first.rate is None and first.last_sequence == begin + 25 and not first.described
    assert set(arm.sensors.read()) == {"imu_1", "elbow"} == set(sim.sensors.read()["arm"])
    with pytest.raises(simd_client.SensorExists):
        arm.sensors.create(ImuSensor(), "elbow")
    arm.sensors.get("elbow").delete()
    with pytest.raises(simd_client.SensorNotFound) as refused:
        arm.sensors.delete("elbow")
    assert refused.value.metadata == {"robot": "arm", "sensor": "elbow"}
    with pytest.raises(simd_client.SensorNotFound):
        arm.sensors.get("elbow")
    assert [each.name for each in sim.sensors.list()] == ["imu_1"]
    kinds = [event.kind for event in _events(sim)]
    assert kinds[-3:] == ["sensor_created", "sensor_created", "sensor_deleted"]


def _events(sim: Simulation) -> list[simd_client.Event]:
    with sim.events(after=0) as events:
        found: list[simd_client.Event] = []
        while True:
            try:
                found.append(events.wait(0.2))
            except simd_client.DeadlineExceeded:
                return found


def test_each_kind_comes_back_as_it_was_made(sim: Simulation, arm: Robot) -> None:
    noise = (
        SensorNoise("force", 0.1, axis=2, bias_mean=0.2, bias_standard_deviation=0.3, quantum=0.01),
        SensorNoise("torque", random_walk=0.4, correlation_time=300.0, dropout=0.5),
    )
    lidar = LidarSensor(0.1, 30.0, Sweep(5, -1.0, 1.0), Sweep(3, -0.2, 0.2), rolling=True)
    pose = Pose.of((0.1, 0.2, 0.3), (0, 0, 1, 0))
    arm.sensors.create(
        ForceTorqueSensor("sensor", "parent_to_child"), "wrist", joint="elbow joint", pose=pose, noise=noise
    )
    arm.sensors.create(lidar, "lidar")
    for kind in (ContactSensor(2.0), RangeSensor(0.0, 5.0), LinkStateSensor(), OdometrySensor()):
        arm.sensors.create(kind)
    wrist, seen, *others = arm.sensors.list()
    assert (wrist.kind, wrist.noise, wrist.pose) == (ForceTorqueSensor("sensor", "parent_to_child"), noise, pose)
    assert seen.kind == lidar
    assert [each.kind for each in others] == [
        ContactSensor(2.0), RangeSensor(0.0, 5.0), LinkStateSensor(), OdometrySensor(),
    ]  # fmt: skip


def test_contacts_ranges_and_motion_of_a_ball(sim: Simulation) -> None:
    sim.add_box((4, 4, 1), name="floor", position=(0, 0, -0.5), fixed=True)
    ball = sim.add_sphere(0.1, mass=2.0, name="ball", position=(0, 0, 0.1))
    foot = ball.sensors.create(ContactSensor(), "foot")
    where = ball.sensors.create(LinkStateSensor(), "where")
    # Down, from above the ball.
    down = ball.sensors.create(RangeSensor(0.05, 5.0), "down", pose=Pose.of((1, 0, 0.3), (0, np.sqrt(0.5), 0, np.sqrt(0.5))))
    sim.step(500)
    touch = foot.read().measurement
    assert touch.touching and touch.more_partners == 0
    assert touch.force == pytest.approx([0, 0, 2.0 * G], rel=1e-3, abs=1e-3)
    (partner,) = touch.partners
    assert (partner.robot, partner.points) == ("floor", 1) and partner.force == pytest.approx(touch.force)
    pose = where.read().measurement.pose
    assert pose.position == pytest.approx([0, 0, 0.1], abs=1e-3)
    assert down.read().measurement == pytest.approx(0.3 + pose.position[2], abs=1e-4)


def test_a_scan_is_a_grid_with_points(sim: Simulation) -> None:
    sim.add_box((1, 10, 10), name="wall", position=(3.5, 0, 0), fixed=True)
    eye = sim.add_box((0.1, 0.1, 0.1), name="eye", fixed=True)
    kind = LidarSensor(0.2, 10.0, Sweep(5, -np.pi, np.pi * 0.6), Sweep(3, -0.3, 0.3))
    lidar = eye.sensors.create(kind, "lidar", pose=Pose.of((0.1, 0, 1)))
    sim.step()
    ranges = lidar.read().measurement.ranges
    assert ranges.shape == (3, 5) and ranges.dtype == np.float32
    assert kind.directions().shape == (3, 5, 3)
    # Hits are on the wall; behind the sensor nothing is hit.
    points = kind.points(ranges)
    assert len(points) == np.isfinite(ranges).sum() > 0
    assert points[:, 0] == pytest.approx(np.full(len(points), 2.9), abs=1e-5)
    assert np.all(ranges[:, 0] == np.inf)


def test_each_reading_comes_in_order_and_what_is_gone_is_counted(sim: Simulation, arm: Robot) -> None:
    imu = arm.sensors.create(ImuSensor(), "imu")
    sim.step(10)
    with imu.readings() as new, imu.readings(after=0) as all_of_them:
        sim.step(30)
        assert [new.wait(5.0).sample for _ in range(30)] == list(range(11, 41))
        seen = [all_of_them.wait(5.0) for _ in range(40)]
        assert [each.sample for each in seen] == list(range(1, 41))
        assert [each.sequence - seen[0].sequence for each in seen] == list(range(40))
        with pytest.raises(simd_client.DeadlineExceeded):
            new.wait(0.0)
        sim.step(5000)
        late = new.wait(5.0)
        assert late.missed == late.sequence - seen[-1].sequence - 1 > 0


def test_lost_readings_are_counted_by_the_next_one() -> None:
    numbers = [7, 8, 12, 13]
    message = proto.SensorReadings(missed=5, readings=[proto.SensorReading(sequence=each) for each in numbers])
    # Three of the five are between 8 and 12.
    assert [each.missed for each in readings_from_proto(message)] == [2, 0, 3, 0]


def test_a_watch_has_the_newest_reading(sim: Simulation, arm: Robot) -> None:
    imu = arm.sensors.create(ImuSensor(), "imu", rate=500)
    sim.step(10)
    with imu.watch() as readings:
        assert readings.newest().sample == 5
        sim.step(1000)
        while (newest := readings.wait(10.0)).sample < 505:
            pass
        assert (newest.sample, newest.missed) == (505, 0)


def test_a_watch_waits_for_the_first_reading_for_as_long_as_its_limit_says(sim: Simulation, arm: Robot) -> None:
    imu = arm.sensors.create(ImuSensor(), "imu")
    with imu.watch() as watch:
        with pytest.raises(simd_client.NoReading, match="no reading yet"):
            watch.newest()
        with pytest.raises(simd_client.DeadlineExceeded, match="no reading came within 0.05 s"):
            watch.wait(0.05)
        sim.step(3)
        assert watch.wait(5.0).sample == 3 == watch.newest().sample


def test_noise_is_that_of_its_seed(sim: Simulation, arm: Robot) -> None:
    noise = [SensorNoise("linear_acceleration", 0.5), SensorNoise("angular_velocity", 0.1, axis=0)]

    def measured(seed: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
        imu = arm.sensors.create(ImuSensor(), "imu", noise=noise, seed=seed)
        sim.reset()
        sim.step(10)
        found = imu.read().measurement
        imu.delete()
        return tuple(found.linear_acceleration), tuple(found.angular_velocity)

    first = measured(1)
    assert measured(1) == first != measured(2)
    (x, _, z), (roll, pitch, _) = first
    assert x != 0.0 and z != pytest.approx(G) and roll != 0.0 and pitch == pytest.approx(0.0, abs=1e-9)


def test_unknown_kinds_are_refused(sim: Simulation, arm: Robot) -> None:
    with pytest.raises(TypeError):
        arm.sensors.create("imu")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="^there is no channel of noise 'sound'; give 'linear_acceleration', "):
        arm.sensors.create(ImuSensor(), noise=[SensorNoise("sound")])  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="^there is no kind of picture 'colour'; give 'color', 'depth'"):
        arm.sensors.create(CameraSensor(4, 3, 1.0, 0.1, 9.0, "colour"))  # type: ignore[arg-type]
    with pytest.raises(simd_client.InvalidValue) as refused:
        arm.sensors.create(ImuSensor(), rate=-1.0)
    assert "sensor.rate" in str(refused.value)


def test_a_camera_says_that_it_has_pictures_and_no_readings(sim: Simulation, arm: Robot) -> None:
    eye = arm.sensors.create(CameraSensor(4, 3, 1.0, 0.1, 9.0), "eye")
    sim.step(5)
    with eye.watch() as watch:
        asked: list[Callable[[], object]] = [
            eye.read, eye.readings, lambda: eye.readings(after=0), watch.newest, lambda: next(watch),
        ]  # fmt: skip
        for ask in asked:
            with pytest.raises(simd_client.NoReading, match="pictures instead of readings"):
                ask()
    assert arm.sensors.read() == {} and arm.sensors.list()[0].unavailable


def test_a_sensor_of_a_robot_that_is_gone_says_so(sim: Simulation, arm: Robot) -> None:
    imu = arm.sensors.create(ImuSensor(), "imu")
    sim.step(3)
    readings = imu.readings(after=0)
    arm.delete()
    asked: list[Callable[[], object]] = [imu.read, imu.info, imu.readings, imu.delete, arm.sensors.list, arm.sensors.read]
    for ask in (*asked, lambda: readings.wait(1.0), lambda: arm.sensors.create(ImuSensor())):
        with pytest.raises(simd_client.RobotNotFound, match="arm"):
            ask()
    assert sim.sensors.list() == () and sim.sensors.read() == {}


async def test_sensors_are_awaited_in_asyncio(daemon: Daemon, arm: Robot) -> None:
    async with aio.connect(daemon.endpoint) as other:
        robot = await other.robot(arm.name)
        imu = await robot.sensors.create(ImuSensor(), "imu")
        await other.step(3)
        assert (await imu.read()).sample == 3
        async with await imu.readings(after=0) as readings:
            assert [(await readings.wait(5.0)).sample for _ in range(3)] == [1, 2, 3]
        async with imu.watch() as watch:
            assert (await watch.newest()).sample == 3
        await imu.delete()


def test_newest_readings_come_beside_joint_states(sim: Simulation, arm: Robot) -> None:
    arm.sensors.create(ImuSensor(), "imu")
    arm.sensors.create(EncoderSensor(), "encoder", joint="elbow joint", rate=100)
    sim.step(25)
    states = sim.next_states(sensors={"arm": ["imu"]})
    assert set(states["arm"].sensors) == {"imu"} and states["arm"].sensors["imu"].stamp.step == 25
    assert set(sim.next_states(selection="arm", sensors=True)["arm"].sensors) == {"imu", "encoder"}
    assert not sim.next_states()["arm"].sensors
    with arm.watch(sensors=["imu", "encoder"]) as watch:
        first = next(watch)
        assert {name: each.stamp.step for name, each in first.sensors.items()} == {"imu": 25, "encoder": 20}
        sim.step(15)
        later = next(watch)
        assert later.stamp.step == 40 and later.sensors["encoder"].stamp.step == 40
    with sim.watch(selection="arm", sensors=["imu"]) as world:
        assert next(world)["arm"].sensors["imu"].stamp.step == 40
    stepped = sim.step(5, states="arm", sensors=True)
    assert {name: each.stamp.step for name, each in stepped["arm"].sensors.items()} == {"imu": 45, "encoder": 40}
    with pytest.raises(ValueError, match="whose sensors"):
        sim.next_states(sensors=["imu"])
    with pytest.raises(simd_client.SensorNotFound):
        sim.next_states(sensors={"arm": ["none"]})
