//! Sensors, as clients make, read, watch and delete them.

use std::time::Duration;

use simd_client::proto::{
    self, ControlWait, ErrorReason, NextJointStatesRequest, SensorChannel, SensorCursor, SensorNoise,
    SensorReading, SensorReadings, StepSimulationRequest, WatchJointStatesRequest, event::Kind, sensor,
    sensor_reading::Measurement,
};
use simd_client::{Client, ControlOptions, every_sensor, some_sensors};
use simd_tests::daemon::{Daemon, Via};
use simd_tests::process::soon;

use crate::{arm, over_every_transport};

const SECOND: Duration = Duration::from_secs(1);

/// Returns a sensor of the arm's root link.
fn on_arm(name: &str, kind: sensor::Kind) -> proto::Sensor {
    proto::Sensor { robot: "arm".into(), name: name.into(), kind: Some(kind), ..Default::default() }
}

pub(crate) fn imu(name: &str) -> proto::Sensor {
    on_arm(name, sensor::Kind::Imu(proto::ImuSensor {}))
}

fn cursor(sensor: &str, after_sequence: u64) -> SensorCursor {
    SensorCursor { robot: "arm".into(), sensor: sensor.into(), after_sequence }
}

fn position(x: f64, z: f64) -> Option<proto::Pose> {
    Some(proto::Pose { position: Some(proto::Vector3 { x, y: 0.0, z }), orientation: None })
}

/// A fixed cube with sides of a metre.
async fn cube(client: &Client, name: &str, x: f64) {
    let side = proto::Vector3 { x: 1.0, y: 1.0, z: 1.0 };
    let geometry = proto::primitive::Geometry::Box(proto::BoxGeometry { size: Some(side) });
    let primitive = proto::Primitive { geometry: Some(geometry), mass: 1.0, color: None };
    let source = proto::DescriptionSource {
        source: Some(proto::description_source::Source::Primitive(primitive)),
        ..Default::default()
    };
    let request = proto::SpawnEntityRequest {
        source: Some(source),
        name: name.into(),
        pose: position(x, 0.0),
        base: proto::Base::Fixed.into(),
        ..Default::default()
    };
    client.spawn(request).await.unwrap();
}

/// Returns the only reading of the only sensor.
pub(crate) fn only(mut all: Vec<SensorReadings>) -> SensorReading {
    assert_eq!(all.len(), 1, "{all:?}");
    let mut readings = all.remove(0).readings;
    assert_eq!(readings.len(), 1, "{readings:?}");
    readings.remove(0)
}

async fn a_sensor_is_made_listed_read_and_deleted(via: Via) {
    let daemon = arm(via).await;
    let client = &daemon.client;
    assert_eq!(client.create_sensor(imu("")).await.unwrap(), "imu_1");
    let encoder = on_arm("elbow", sensor::Kind::Encoder(proto::EncoderSensor { backlash: 0.25 }));
    let encoder = proto::Sensor { joint: "shoulder".into(), rate: Some(100.0), seed: 7, ..encoder };
    assert_eq!(client.create_sensor(encoder).await.unwrap(), "elbow");
    let all = client.sensors(None).await.unwrap();
    assert!(all.iter().all(|info| info.last_sequence == 0 && !info.described && info.unavailable.is_empty()));
    let elbow = all[1].sensor.clone().unwrap();
    assert_eq!((elbow.joint.as_str(), elbow.rate, elbow.seed), ("shoulder", Some(100.0), 7));
    assert_eq!(elbow.kind, Some(sensor::Kind::Encoder(proto::EncoderSensor { backlash: 0.25 })));
    assert!(
        client
            .sensor_readings(vec![every_sensor("arm")])
            .await
            .unwrap()
            .iter()
            .all(|of| of.readings.is_empty())
    );
    client.step(25).await.unwrap();
    let imu = only(client.sensor_readings(vec![some_sensors("arm", ["imu_1"])]).await.unwrap());
    assert_eq!((imu.sequence, imu.sample, imu.stamp.unwrap().step), (25, 25, 25));
    let Some(Measurement::Imu(measured)) = imu.measurement else { panic!("{imu:?}") };
    // The arm is bolted to the world.
    let up = measured.linear_acceleration.unwrap();
    assert!((up.z - 9.81).abs() < 1e-9 && up.x.abs() < 1e-9 && up.y.abs() < 1e-9, "{up:?}");
    let elbow = only(client.sensor_readings(vec![some_sensors("arm", ["elbow"])]).await.unwrap());
    assert_eq!((elbow.sample, elbow.stamp.unwrap().step), (2, 20), "a hundred a second of a thousand steps");
    assert!(matches!(elbow.measurement, Some(Measurement::Encoder(_))));
    client.delete_sensor("arm", "imu_1").await.unwrap();
    assert_eq!(client.sensors(Some("arm")).await.unwrap().len(), 1);
    let events = client.next_events(0, Duration::ZERO).await.unwrap().events;
    let said = events.into_iter().filter_map(|event| match event.kind {
        Some(Kind::SensorCreated(it)) => Some(("created", it.sensor)),
        Some(Kind::SensorDeleted(it)) => Some(("deleted", it.sensor)),
        _ => None,
    });
    let expected = [("created", "imu_1"), ("created", "elbow"), ("deleted", "imu_1")];
    assert_eq!(said.collect::<Vec<_>>(), expected.map(|(what, name)| (what, name.to_owned())));
}

async fn invalid_values_are_refused_by_their_field(via: Via) {
    let daemon = arm(via).await;
    let client = &daemon.client;
    client.create_sensor(imu("imu")).await.unwrap();
    let noise = |noise: SensorNoise| proto::Sensor { noise: vec![noise], ..imu("") };
    let acceleration = SensorChannel::LinearAcceleration.into();
    let lidar = |samples: u32| {
        let horizontal = Some(proto::Sweep { samples, min: -1.0, max: 1.0 });
        let range = Some(proto::RangeLimits { min: 0.0, max: 1.0 });
        on_arm("", sensor::Kind::Lidar(proto::LidarSensor { horizontal, range, ..Default::default() }))
    };
    for (sensor, field) in [
        (proto::Sensor { kind: None, ..imu("") }, "sensor.kind"),
        (proto::Sensor { rate: Some(-1.0), ..imu("") }, "sensor.rate"),
        (proto::Sensor { name: "a b".into(), ..imu("") }, "sensor.name"),
        (
            noise(SensorNoise { channel: acceleration, standard_deviation: -1.0, ..Default::default() }),
            "noise[0].standard_deviation",
        ),
        (noise(SensorNoise { channel: acceleration, axis: Some(3), ..Default::default() }), "noise[0].axis"),
        (
            noise(SensorNoise { channel: acceleration, axis: Some(300), ..Default::default() }),
            "noise[0].axis",
        ),
        (noise(SensorNoise::default()), "noise[0].channel"),
        (on_arm("", sensor::Kind::Range(proto::RangeSensor { min: 1.0, max: 0.5 })), "sensor.range.max"),
        (
            proto::Sensor {
                joint: "shoulder".into(),
                ..on_arm("", sensor::Kind::Encoder(proto::EncoderSensor { backlash: f64::INFINITY }))
            },
            "sensor.encoder.backlash",
        ),
        (lidar(0), "sensor.lidar.horizontal.samples"),
        (lidar(u32::MAX), "sensor.lidar.horizontal.samples"),
        (
            on_arm("", sensor::Kind::Contact(proto::ContactSensor { threshold: f64::NAN })),
            "sensor.contact.threshold",
        ),
    ] {
        let refused = client.create_sensor(sensor).await.unwrap_err();
        assert_eq!(refused.reason(), Some(ErrorReason::InvalidValue), "{field}: {refused}");
        assert!(refused.to_string().contains(field), "{field}: {refused}");
    }
    assert_eq!(client.sensors(None).await.unwrap().len(), 1, "nothing was made");
    let again = client.create_sensor(imu("imu")).await.unwrap_err();
    assert_eq!(again.reason(), Some(ErrorReason::SensorExists));
    let unknown = client.delete_sensor("arm", "ear").await.unwrap_err();
    assert_eq!(unknown.reason(), Some(ErrorReason::SensorNotFound));
    let unknown = client.sensor_readings(vec![some_sensors("arm", ["ear"])]).await.unwrap_err();
    assert_eq!(unknown.reason(), Some(ErrorReason::SensorNotFound));
    assert!(unknown.to_string().contains("imu"), "it names those that there are: {unknown}");
    let elsewhere = client.create_sensor(proto::Sensor { robot: "leg".into(), ..imu("") }).await.unwrap_err();
    assert_eq!(elsewhere.reason(), Some(ErrorReason::RobotNotFound));
    for cursors in [vec![], vec![cursor("imu", 0); 2], vec![cursor("imu", 0); 65]] {
        let refused = client.next_sensor_readings(cursors, Duration::ZERO).await.unwrap_err();
        assert_eq!(refused.reason(), Some(ErrorReason::InvalidValue), "{refused}");
    }
    let nothing = client.watch_sensors(vec![some_sensors("arm", ["ear"])], 50.0).await.unwrap_err();
    assert_eq!(nothing.reason(), Some(ErrorReason::SensorNotFound));
}

/// A reader that looks away for ten steps, and one that waits.
async fn readings_come_without_a_hole_to_who_asks_for_the_next(via: Via) {
    let daemon = arm(via).await;
    let client = &daemon.client;
    client.create_sensor(imu("imu")).await.unwrap();
    let mut after = 0;
    let mut samples = Vec::new();
    for steps in [10, 1, 300] {
        client.step(steps).await.unwrap();
        let mut next = client.next_sensor_readings(vec![cursor("imu", after)], SECOND).await.unwrap();
        let SensorReadings { readings, missed, after_sequence, .. } = next.remove(0);
        assert_eq!((readings.len() as u64, missed), (steps, 0));
        samples.extend(
            readings.iter().map(|reading| (reading.sequence, reading.sample, reading.stamp.unwrap().step)),
        );
        after = after_sequence;
    }
    assert_eq!(samples, (1..=311).map(|step| (step, step, step)).collect::<Vec<_>>());
    let nothing = client.next_sensor_readings(vec![cursor("imu", after)], Duration::ZERO).await.unwrap();
    assert_eq!((nothing[0].readings.len(), nothing[0].after_sequence), (0, after));
    let waits = client.next_sensor_readings(vec![cursor("imu", after)], Duration::from_secs(60));
    let (next, stepped) = tokio::join!(waits, client.step(1));
    stepped.unwrap();
    assert_eq!(only(next.unwrap()).sequence, after + 1);
    // The log is bounded, and reports lost readings.
    client.step(5_000).await.unwrap();
    let next = client.next_sensor_readings(vec![cursor("imu", after)], SECOND).await.unwrap().remove(0);
    assert!(next.missed > 0, "{}", next.missed);
    assert_eq!(next.readings[0].sequence, after + next.missed + 1);
    let last = next.readings.last().unwrap().sequence;
    assert_eq!(last, after + next.missed + next.readings.len() as u64);
}

async fn a_watch_has_each_reading_until_its_sensor_goes(via: Via) {
    let daemon = arm(via).await;
    let client = &daemon.client;
    client.create_sensor(imu("imu")).await.unwrap();
    let slow = proto::Sensor { rate: Some(100.0), ..imu("slow") };
    client.create_sensor(slow).await.unwrap();
    client.step(5).await.unwrap();
    // Earlier readings are not in a watch.
    let mut watch = client.watch_sensors(vec![every_sensor("arm")], 1000.0).await.unwrap();
    client.step(100).await.unwrap();
    let (mut all, mut slow) = (Vec::new(), 0);
    while all.len() < 100 || slow < 10 {
        for of in soon("readings", watch.next()).await.unwrap().unwrap() {
            assert_eq!((of.robot.as_str(), of.missed), ("arm", 0));
            match of.sensor.as_str() {
                "imu" => all.extend(of.readings.iter().map(|reading| reading.sequence)),
                _ => slow += of.readings.len(),
            }
        }
    }
    assert_eq!(all, (6..=105).collect::<Vec<u64>>());
    client.delete_sensor("arm", "slow").await.unwrap();
    let ended = async {
        loop {
            match watch.next().await {
                Ok(Some(_)) => {}
                other => return other.unwrap_err(),
            }
        }
    };
    assert_eq!(soon("the end", ended).await.reason(), Some(ErrorReason::SensorNotFound));
}

/// Ranges are measured on other threads. A call returns those of the very step.
async fn ranges_are_of_the_state_that_the_caller_sees(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let client = &daemon.client;
    cube(client, "eye", 0.0).await;
    cube(client, "wall", 4.0).await;
    let ray = sensor::Kind::Range(proto::RangeSensor { min: 0.1, max: 10.0 });
    let scan = sensor::Kind::Lidar(proto::LidarSensor {
        horizontal: Some(proto::Sweep { samples: 3, min: -0.1, max: 0.1 }),
        vertical: Some(proto::Sweep { samples: 2, min: 0.0, max: 1.0 }),
        range: Some(proto::RangeLimits { min: 0.1, max: 10.0 }),
        ..Default::default()
    });
    // In front of the cube that carries it.
    let on_eye = |name: &str, kind| proto::Sensor {
        robot: "eye".into(),
        name: name.into(),
        pose: position(1.0, 0.0),
        kind: Some(kind),
        ..Default::default()
    };
    client.create_sensor(on_eye("ray", ray)).await.unwrap();
    client.create_sensor(on_eye("scan", scan)).await.unwrap();
    for step in 1..=20 {
        client.step(1).await.unwrap();
        let all = client.sensor_readings(vec![every_sensor("eye")]).await.unwrap();
        for of in &all {
            let [reading] = of.readings.as_slice() else { panic!("{all:?}") };
            assert_eq!(reading.stamp.unwrap().step, step, "{all:?}");
        }
        let Some(Measurement::Range(range)) = all[0].readings[0].measurement else { panic!("{all:?}") };
        assert!((range.range - 2.5).abs() < 1e-9, "{range:?}");
        let Some(Measurement::Lidar(lidar)) = &all[1].readings[0].measurement else { panic!("{all:?}") };
        // A row in the plane, and one that passes above the wall.
        let slant = (2.5 / 0.1_f64.cos()) as f32;
        let near = |range: f32, expected: f32| (range - expected).abs() < 1e-6;
        assert_eq!((lidar.columns, lidar.ranges.len()), (3, 6));
        assert!(
            near(lidar.ranges[0], slant) && near(lidar.ranges[1], 2.5) && near(lidar.ranges[2], slant),
            "{lidar:?}"
        );
        assert!(lidar.ranges[3..].iter().all(|range| *range == f32::INFINITY), "{lidar:?}");
    }
}

async fn a_restored_state_gives_the_same_noise_again(via: Via) {
    let daemon = arm(via).await;
    let client = &daemon.client;
    let walking = SensorNoise {
        channel: SensorChannel::AngularVelocity.into(),
        standard_deviation: 0.1,
        random_walk: 0.01,
        bias_standard_deviation: 0.2,
        ..Default::default()
    };
    client.create_sensor(proto::Sensor { noise: vec![walking], seed: 3, ..imu("imu") }).await.unwrap();
    client.step(50).await.unwrap();
    client.save_state("here").await.unwrap();
    let run = async || {
        client.step(20).await.unwrap();
        let last = client.sensors(None).await.unwrap()[0].last_sequence;
        let next =
            client.next_sensor_readings(vec![cursor("imu", last - 20)], SECOND).await.unwrap().remove(0);
        next.readings.into_iter().map(|reading| (reading.sample, reading.measurement)).collect::<Vec<_>>()
    };
    let first = run().await;
    assert_eq!(first.len(), 20);
    client.restore_state("here").await.unwrap();
    assert_eq!(run().await, first);
    assert_ne!(run().await, first, "time goes on");
}

/// From a call, a stream and a controller.
async fn newest_readings_come_beside_joint_states(via: Via) {
    let daemon = arm(via).await;
    let client = &daemon.client;
    client.create_sensor(imu("imu")).await.unwrap();
    client.create_sensor(imu("other")).await.unwrap();
    let ask = |sensors| NextJointStatesRequest { sensors, timeout: 1.0, ..Default::default() };
    let before = client.next_joint_states(ask(vec![every_sensor("arm")])).await.unwrap();
    assert!(before.sensors.len() == 2 && before.sensors.iter().all(|of| of.readings.is_empty()));
    client.step(5).await.unwrap();
    let seen = client.next_joint_states(ask(vec![some_sensors("arm", ["imu"])])).await.unwrap();
    assert_eq!(seen.states.unwrap().stamp.unwrap().step, 5);
    assert_eq!(seen.sensors[0].sensor, "imu");
    assert_eq!(only(seen.sensors).stamp.unwrap().step, 5);
    assert!(client.next_joint_states(ask(Vec::new())).await.unwrap().sensors.is_empty());

    let request =
        WatchJointStatesRequest { sensors: vec![some_sensors("arm", ["imu"])], ..Default::default() };
    let mut watch = client.watch_joint_states(request).await.unwrap();
    let answer = soon("a state", watch.next_answer()).await.unwrap().unwrap();
    assert_eq!(only(answer.sensors).sample, 5);

    // In the same call as the step.
    let request =
        StepSimulationRequest { steps: 1, sensors: vec![every_sensor("arm")], ..Default::default() };
    let stepped = client.step_with(request).await.unwrap();
    assert_eq!(stepped.sensors.len(), 2);
    assert!(stepped.sensors.iter().all(|of| of.readings[0].stamp.unwrap().step == 6));

    // Given once, and kept from request to request.
    let sensors = vec![some_sensors("arm", ["other"])];
    let options = ControlOptions { sensors, wait: ControlWait::None, ..Default::default() };
    let mut control = client.control(options).await.unwrap();
    for step in [6, 7] {
        let reply = control.next().await.unwrap();
        assert_eq!(only(reply.sensors).stamp.unwrap().step, step);
        client.step(1).await.unwrap();
    }

    let refused = client.next_joint_states(ask(vec![some_sensors("arm", ["none"])])).await.unwrap_err();
    assert_eq!(refused.reason(), Some(ErrorReason::SensorNotFound));
    let twice = vec![every_sensor("arm"), every_sensor("arm")];
    let refused = client.next_joint_states(ask(twice)).await.unwrap_err();
    assert!(refused.to_string().contains("sensors[1]"), "{refused}");
}

over_every_transport! {
    a_sensor_is_made_listed_read_and_deleted,
    invalid_values_are_refused_by_their_field,
    readings_come_without_a_hole_to_who_asks_for_the_next,
    a_watch_has_each_reading_until_its_sensor_goes,
    ranges_are_of_the_state_that_the_caller_sees,
    a_restored_state_gives_the_same_noise_again,
    newest_readings_come_beside_joint_states,
}
