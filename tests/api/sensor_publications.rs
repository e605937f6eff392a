//! Readings as they are published over Zenoh.

use prost::Message;
use simd_client::proto::SensorReadings;
use simd_tests::daemon::{Daemon, Via};
use simd_tests::network;
use simd_tests::process::soon;
use zenoh::handlers::FifoChannel;

use crate::arm;
use crate::sensors::{imu, only};

/// A sensor of each step, in few messages.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn readings_are_published_in_batches_without_a_hole() {
    let daemon = Daemon::start_via(Via::Zenoh, |_| {}).await;
    crate::load_arm(&daemon.client, "arm").await;
    daemon.client.create_sensor(imu("imu")).await.unwrap();
    let session = network::session("client", &daemon.running.locators()[0]).await;
    let key = "simd/simd/sensor_readings/arm/imu";
    let subscriber = session.declare_subscriber(key).with(FifoChannel::new(256)).await.unwrap();
    let (mut sequences, mut messages) = (Vec::new(), 0);
    while sequences.len() < 300 {
        let sample = soon("readings", subscriber.recv_async()).await.unwrap();
        assert_eq!(sample.encoding().to_string(), "application/protobuf;simd.v1.SensorReadings");
        let batch = SensorReadings::decode(&*sample.payload().to_bytes()).unwrap();
        assert_eq!((batch.robot.as_str(), batch.sensor.as_str()), ("arm", "imu"));
        sequences.extend(batch.readings.iter().map(|reading| reading.sequence));
        messages += 1;
    }
    let first = sequences[0];
    assert_eq!(sequences, (first..first + sequences.len() as u64).collect::<Vec<_>>());
    // Some twenty steps fit in a message's time, on a machine that keeps up.
    assert!(messages < sequences.len() / 2, "{messages} messages for {} readings", sequences.len());
}

/// A world that stands still publishes its newest reading for late subscribers.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn late_subscribers_get_the_newest_reading() {
    let daemon = arm(Via::Zenoh).await;
    daemon.client.create_sensor(imu("imu")).await.unwrap();
    daemon.client.step(3).await.unwrap();
    let session = network::session("client", &daemon.running.locators()[0]).await;
    for _ in 0..2 {
        let key = "simd/simd/sensor_readings/*/*";
        let subscriber = session.declare_subscriber(key).with(FifoChannel::new(256)).await.unwrap();
        let sample = soon("a reading", subscriber.recv_async()).await.unwrap();
        let batch = SensorReadings::decode(&*sample.payload().to_bytes()).unwrap();
        assert_eq!(only(vec![batch]).sequence, 3);
    }
}
