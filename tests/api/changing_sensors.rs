//! Sensors that are added and removed, and many sensors, while clients read them.

use std::time::Duration;

use simd_client::proto::{
    self, ErrorReason, GetPictureRequest, PictureMoment, ReloadEntityRequest, ResetSimulationRequest,
    SensorChannel, SensorCursor, SensorNoise, SensorReadings, sensor,
};
use simd_client::{Client, SensorWatch, every_sensor, some_sensors};
use simd_tests::daemon::{Daemon, Via, fixed};
use simd_tests::process::soon;
use simd_tests::robots::assets;

use crate::cameras::camera;
use crate::{arm, over_every_transport};

fn imu(name: &str) -> proto::Sensor {
    let noise = SensorNoise {
        channel: SensorChannel::AngularVelocity.into(),
        standard_deviation: 0.1,
        random_walk: 0.01,
        ..Default::default()
    };
    let kind = Some(sensor::Kind::Imu(proto::ImuSensor {}));
    proto::Sensor { robot: "arm".into(), name: name.into(), kind, noise: vec![noise], ..Default::default() }
}

/// Returns this many readings of a watch of one sensor, each with the numbers of the reading and the sample,
/// and the measurement.
async fn read(
    watch: &mut SensorWatch,
    count: usize,
) -> Vec<(u64, u64, Option<proto::sensor_reading::Measurement>)> {
    let mut all = Vec::new();
    while all.len() < count {
        for of in soon("readings", watch.next()).await.unwrap().unwrap() {
            assert_eq!(of.missed, 0);
            all.extend(of.readings.into_iter().map(|it| (it.sequence, it.sample, it.measurement)));
        }
    }
    assert_eq!(all.len(), count, "{all:?}");
    all
}

/// Returns the error that ends a watch.
async fn end(watch: &mut SensorWatch) -> simd_client::Error {
    let ended = async {
        loop {
            if let Err(error) = watch.next().await {
                return error;
            }
        }
    };
    soon("the end", ended).await
}

/// Time jumps back, and the watch continues. Numbers of readings grow, and samples and their numbers are the
/// restored ones. For a watcher, a sensor that the restored state does not have is gone.
async fn a_watch_continues_over_a_restored_state(via: Via) {
    let daemon = arm(via).await;
    let client = &daemon.client;
    client.create_sensor(imu("imu")).await.unwrap();
    client.step(50).await.unwrap();
    client.save_state("here").await.unwrap();
    client.create_sensor(imu("later")).await.unwrap();
    let mut watch = client.watch_sensors(vec![some_sensors("arm", ["imu"])], 1000.0).await.unwrap();
    let mut later = client.watch_sensors(vec![some_sensors("arm", ["later"])], 1000.0).await.unwrap();
    client.step(20).await.unwrap();
    let first = read(&mut watch, 20).await;
    assert_eq!(read(&mut later, 20).await.first().map(|it| it.1), Some(1));
    client.restore_state("here").await.unwrap();
    client.step(20).await.unwrap();
    let second = read(&mut watch, 20).await;
    let samples = |of: &[(u64, u64, _)]| of.iter().map(|it| it.1).collect::<Vec<_>>();
    assert_eq!(samples(&first), (51..=70).collect::<Vec<_>>());
    assert_eq!(samples(&second), samples(&first));
    for (one, other) in first.iter().zip(&second) {
        assert_eq!((one.0 + 20, &one.2), (other.0, &other.2), "what is restored is measured alike");
    }
    assert_eq!(end(&mut later).await.reason(), Some(ErrorReason::SensorNotFound));

    // A reset of time restarts the count of samples.
    client.reset(ResetSimulationRequest { time: true, ..Default::default() }).await.unwrap();
    client.step(3).await.unwrap();
    assert_eq!(samples(&read(&mut watch, 3).await), [1, 2, 3]);

    // A reload keeps a client's sensors.
    client.reload(ReloadEntityRequest { robot: "arm".into(), ..Default::default() }).await.unwrap();
    client.step(2).await.unwrap();
    assert_eq!(samples(&read(&mut watch, 2).await), [4, 5]);
    client.delete_robot("arm").await.unwrap();
    assert_eq!(end(&mut watch).await.reason(), Some(ErrorReason::RobotNotFound));
}

/// Immediately, and not only when the wait for the picture ends.
async fn a_client_that_waits_for_a_camera_learns_of_its_end(via: Via) {
    let daemon = arm(via).await;
    let client = &daemon.client;
    client.create_sensor(camera("eye", Some(100.0))).await.unwrap();
    client.next_picture("one", Duration::ZERO).await.unwrap();
    let request = GetPictureRequest {
        robot: "arm".into(),
        sensor: "eye".into(),
        moment: PictureMoment::Next.into(),
        timeout: 60.0,
        ..Default::default()
    };
    let goes = async {
        let mut looks = tokio::time::interval(Duration::from_millis(5));
        while !client.list_cameras().await.unwrap().cameras[0].followed {
            looks.tick().await;
        }
        client.delete_sensor("arm", "eye").await.unwrap();
    };
    let (picture, ()) = tokio::join!(soon("an answer", client.get_picture(request)), goes);
    assert_eq!(picture.unwrap_err().reason(), Some(ErrorReason::SensorNotFound));
}

/// All calls for the sensors of a removed robot are refused with its name. A new robot of that name has none
/// of them, and its readings have larger numbers than all earlier ones.
async fn sensors_of_a_removed_robot_are_gone_for_every_call(via: Via) {
    let daemon = arm(via).await;
    let client = &daemon.client;
    client.create_sensor(imu("imu")).await.unwrap();
    client.create_sensor(camera("eye", None)).await.unwrap();
    client.step(7).await.unwrap();
    let cursor = |after_sequence| SensorCursor { robot: "arm".into(), sensor: "imu".into(), after_sequence };
    let before = client.sensors(None).await.unwrap()[0].last_sequence;
    client.delete_robot("arm").await.unwrap();
    let asked = [
        client.sensors(Some("arm")).await.map(drop),
        client.sensor_readings(vec![every_sensor("arm")]).await.map(drop),
        client.next_sensor_readings(vec![cursor(0)], Duration::from_secs(60)).await.map(drop),
        client.watch_sensors(vec![some_sensors("arm", ["imu"])], 50.0).await.map(drop),
        client.picture("arm", "eye").await.map(drop),
        client.next_camera_picture("arm", "eye", 0).await.map(drop),
        client.create_sensor(imu("new")).await.map(drop),
        client.delete_sensor("arm", "imu").await.map(drop),
    ];
    for (number, answer) in asked.into_iter().enumerate() {
        let refused = answer.unwrap_err();
        assert_eq!(refused.reason(), Some(ErrorReason::RobotNotFound), "{number}: {refused}");
        assert!(refused.to_string().contains("arm"), "{number}: {refused}");
    }
    assert!(client.sensors(None).await.unwrap().is_empty());
    assert!(client.list_cameras().await.unwrap().cameras.is_empty());
    crate::load_arm(client, "arm").await;
    let gone = client.sensor_readings(vec![some_sensors("arm", ["imu"])]).await.unwrap_err();
    assert_eq!(gone.reason(), Some(ErrorReason::SensorNotFound), "{gone}");
    client.create_sensor(imu("imu")).await.unwrap();
    client.step(1).await.unwrap();
    let next = client.next_sensor_readings(vec![cursor(before)], Duration::from_secs(5)).await.unwrap();
    assert_eq!((next[0].readings.len(), next[0].missed), (1, 0), "{next:?}");
    assert!(next[0].readings[0].sequence > before && next[0].readings[0].sample == 1, "{next:?}");
}

/// The maximum number of sensors, on sixteen robots: each answer has all readings of one step. A removed
/// robot takes its sensors with it.
async fn a_thousand_sensors_are_read_at_once(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let client = &daemon.client;
    for robot in 0..16 {
        many(client, &format!("arm-{robot}")).await;
    }
    let more = client.create_sensor(proto::Sensor { robot: "arm-0".into(), ..imu("") }).await.unwrap_err();
    assert_eq!(more.reason(), Some(ErrorReason::LimitExceeded), "{more}");
    client.step(30).await.unwrap();
    // Ranges of hundreds of sensors take longer on a busy machine than one call waits.
    let all = async {
        loop {
            let all = client.sensor_readings(Vec::new()).await.unwrap();
            assert_eq!(all.len(), 1_024);
            if all.iter().all(is_of_thirty_steps) {
                return;
            }
        }
    };
    soon("a reading of each", all).await;
    let refused = client.watch_sensors(Vec::new(), 50.0).await.unwrap_err();
    assert_eq!(refused.reason(), Some(ErrorReason::LimitExceeded), "{refused}");
    let mut watch = client.watch_sensors(vec![every_sensor("arm-3")], 1000.0).await.unwrap();
    client.step(100).await.unwrap();
    let mut counts = std::collections::BTreeMap::new();
    while counts.len() < 64 || counts.values().any(|count| *count < 100) {
        for of in soon("readings", watch.next()).await.unwrap().unwrap() {
            *counts.entry(of.sensor).or_insert(0) += of.readings.len() + of.missed as usize;
        }
    }
    client.delete_robot("arm-3").await.unwrap();
    assert_eq!(end(&mut watch).await.reason(), Some(ErrorReason::RobotNotFound));
    assert_eq!(client.sensors(None).await.unwrap().len(), 960);
    client.step(1).await.unwrap();
    assert!(client.sensor_readings(Vec::new()).await.unwrap().iter().all(|of| of.readings.len() == 1));
}

fn is_of_thirty_steps(of: &SensorReadings) -> bool {
    let [reading] = &of.readings[..] else { return false };
    (reading.sample, reading.stamp.as_ref().unwrap().step) == (30, 30)
}

/// An arm with 64 sensors of eight kinds.
async fn many(client: &Client, robot: &str) {
    client.load(assets().join("Bench_Arm-1.2 rev B"), fixed(robot)).await.unwrap();
    for number in 0..64 {
        let kind = match number % 8 {
            0 => sensor::Kind::Imu(proto::ImuSensor {}),
            1 => sensor::Kind::ForceTorque(proto::ForceTorqueSensor::default()),
            2 => sensor::Kind::Contact(proto::ContactSensor { threshold: 0.0 }),
            3 => sensor::Kind::Range(proto::RangeSensor { min: 0.0, max: 5.0 }),
            4 => sensor::Kind::LinkState(proto::LinkStateSensor {}),
            5 => sensor::Kind::Encoder(proto::EncoderSensor { backlash: 0.01 }),
            6 => sensor::Kind::Odometry(proto::OdometrySensor {}),
            _ => sensor::Kind::Lidar(proto::LidarSensor {
                horizontal: Some(proto::Sweep { samples: 3, min: -1.0, max: 1.0 }),
                range: Some(proto::RangeLimits { min: 0.0, max: 5.0 }),
                ..Default::default()
            }),
        };
        let joint = if matches!(number % 8, 1 | 5) { "shoulder" } else { "" };
        let (robot, joint, kind) = (robot.into(), joint.into(), Some(kind));
        client.create_sensor(proto::Sensor { robot, joint, kind, ..Default::default() }).await.unwrap();
    }
}

over_every_transport! {
    a_watch_continues_over_a_restored_state,
    a_client_that_waits_for_a_camera_learns_of_its_end,
    sensors_of_a_removed_robot_are_gone_for_every_call,
    a_thousand_sensors_are_read_at_once,
}
