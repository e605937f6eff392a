//! Readings of sensors: each sensor has a key with fifty messages per second, which contain the new readings.

use std::collections::BTreeMap;
use std::time::Duration;

use prost::Message as _;
use simd_proto::keys;
use tokio::time::{Instant, MissedTickBehavior, interval};
use zenoh::pubsub::Publisher;

use super::{Demand, UNCHANGED, World, has_subscribers, publisher, put_all};
use simd_api::convert::to_proto;
use simd_world::handle::{CallError, MAX_WATCHED_SENSORS, SensorCursor};

/// Name of the message in the schema.
pub(super) const MESSAGE: &str = "SensorReadings";
/// Time between two messages of a sensor.
const PERIOD: Duration = Duration::from_millis(20);

/// A sensor's key.
struct Topic {
    publisher: Publisher<'static>,
    /// Progress, present while it has a subscriber.
    followed: Option<Followed>,
}

/// Progress of a sensor's publication.
struct Followed {
    /// Number of the last published reading.
    after: u64,
    /// Time of the last message.
    at: Instant,
}

/// Publishes while it is polled.
pub(super) async fn publish(world: World, mut demand: Demand) {
    let mut ticks = interval(PERIOD);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut topics: BTreeMap<(String, String), Topic> = BTreeMap::new();
    loop {
        demand.wait().await;
        ticks.tick().await;
        let cursors = follow(&world, &mut topics).await;
        for cursors in cursors.chunks(MAX_WATCHED_SENSORS) {
            // A sensor deleted in the meantime is missing in the next round.
            if let Err(error) = publish_some(&world, &mut topics, cursors) {
                tracing::debug!("readings are not published: {error}");
            }
        }
    }
}

/// Declares a key for each existing sensor; returns the sensors with a subscriber, and their positions.
async fn follow(world: &World, topics: &mut BTreeMap<(String, String), Topic>) -> Vec<SensorCursor> {
    let Ok((state, sensors)) = world.handle.sensors(None) else { return Vec::new() };
    let robots = &state.state.world.entities;
    let named = sensors.iter().filter_map(|(sensor, last)| {
        Some(((robots.get(sensor.robot)?.name.clone(), sensor.definition.name.clone()), *last))
    });
    let last: BTreeMap<(String, String), u64> = named.collect();
    topics.retain(|of, _| last.contains_key(of));
    let (mut cursors, now) = (Vec::new(), Instant::now());
    for ((robot, sensor), last) in last {
        let of = (robot, sensor);
        if !topics.contains_key(&of) {
            let key = keys::sensor_readings(&world.name, &of.0, &of.1);
            match publisher(&world.session, key, MESSAGE).await {
                Ok(publisher) => drop(topics.insert(of.clone(), Topic { publisher, followed: None })),
                Err(error) => tracing::warn!(robot = of.0, sensor = of.1, "cannot be published: {error}"),
            }
        }
        let Some(topic) = topics.get_mut(&of) else { continue };
        if !has_subscribers(&topic.publisher) {
            topic.followed = None;
            continue;
        }
        // Late subscribers receive the newest reading.
        let newest = || Followed { after: last.saturating_sub(1), at: now };
        let followed = topic.followed.get_or_insert_with(newest);
        if now.duration_since(followed.at) >= UNCHANGED && followed.after == last {
            *followed = newest();
        }
        let (robot, sensor) = of;
        cursors.push(SensorCursor { robot, sensor, after: followed.after });
    }
    cursors
}

fn publish_some(
    world: &World,
    topics: &mut BTreeMap<(String, String), Topic>,
    cursors: &[SensorCursor],
) -> Result<(), CallError> {
    let (mut messages, now) = (Vec::new(), Instant::now());
    for readings in world.handle.readings_after(cursors)? {
        let of = (readings.robot.clone(), readings.sensor.clone());
        let followed = topics.get_mut(&of).and_then(|topic| topic.followed.as_mut());
        if let Some(followed) = followed.filter(|_| readings.batch.is_news()) {
            *followed = Followed { after: readings.batch.after, at: now };
            messages.push((of, to_proto::sensor::readings(readings).encode_to_vec()));
        }
    }
    let messages = messages.into_iter();
    put_all(messages.filter_map(|(of, bytes)| Some((&topics.get(&of)?.publisher, bytes))));
    Ok(())
}
