//! Publications for subscriptions within the process: the Zenoh front-end's, with the same keys, messages and
//! rates. Each has a separate task while it is subscribed to.

use std::collections::BTreeMap;
use std::time::Duration;

use prost::Message as _;
use simd_proto::{keys, v1};
use tokio::time::{MissedTickBehavior, interval};

use super::notices::{Notifier, Ticket, What};
use simd_api::convert::to_proto;
use simd_api::publication::{Encode, STATISTICS, UNCHANGED, joint_states, link_poses, newest};
use simd_world::SimHandle;
use simd_world::handle::{CallError, MAX_WATCHED_SENSORS, SensorCursor};

/// Longest wait of one look for events.
const WAIT: Duration = Duration::from_secs(60);
/// Time between two messages of a sensor.
const SENSORS: Duration = Duration::from_millis(20);
/// Placeholder that stands for all names.
const ALL: &str = "*";

/// A topic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Topic {
    /// States of a robot's joints; `*` stands for each robot.
    JointStates(String),
    /// Poses of a robot's links; `*` stands for each robot.
    LinkPoses(String),
    /// Readings of a robot's sensor; `*` stands for each.
    SensorReadings(String, String),
    /// Timing statistics of the world, ten times per second.
    Statistics,
    /// Events.
    Events,
    /// All parameters whenever one changes.
    Parameters,
}

impl Topic {
    /// Parses a key as it is over Zenoh, `simd/NAME/...`; `None` if the daemon has no such publication.
    pub fn parse(key: &str) -> Option<Self> {
        let mut chunks = key.strip_prefix("simd/")?.split('/').skip(1);
        let kind = chunks.next()?;
        let (first, second) = (chunks.next(), chunks.next());
        if chunks.next().is_some() {
            return None;
        }
        match (kind, first.map(str::to_owned), second.map(str::to_owned)) {
            ("joint_states", Some(robot), None) => Some(Self::JointStates(robot)),
            ("link_poses", Some(robot), None) => Some(Self::LinkPoses(robot)),
            ("sensor_readings", Some(robot), Some(sensor)) => Some(Self::SensorReadings(robot, sensor)),
            ("world_statistics", None, None) => Some(Self::Statistics),
            ("events", None, None) => Some(Self::Events),
            ("parameters", None, None) => Some(Self::Parameters),
            _ => None,
        }
    }
}

/// Publishes until the world drains.
pub(super) async fn publish(
    handle: &SimHandle,
    topic: Topic,
    rate: f64,
    ticket: Ticket,
    notifier: &Notifier,
) {
    let to = To { handle, name: &handle.info().name, ticket, notifier };
    // The drain of the world ends it, and is not a fault.
    let _ended = match topic {
        Topic::JointStates(robot) => to.each_robot(&robot, rate, keys::joint_states, joint_states).await,
        Topic::LinkPoses(robot) => to.each_robot(&robot, rate, keys::link_poses, link_poses).await,
        Topic::SensorReadings(robot, sensor) => to.readings(&robot, &sensor).await,
        Topic::Statistics => to.statistics().await,
        Topic::Events => to.events().await,
        Topic::Parameters => to.parameters().await,
    };
}

/// A subscription.
struct To<'a> {
    handle: &'a SimHandle,
    name: &'a str,
    ticket: Ticket,
    notifier: &'a Notifier,
}

/// Publishing only ends with an error.
type Ended = Result<std::convert::Infallible, CallError>;

impl To<'_> {
    async fn notify(&self, key: String, payload: Vec<u8>) {
        self.notifier.notify(self.ticket, What::Published { key, payload }).await;
    }

    async fn each_robot(
        &self,
        wanted: &str,
        rate: f64,
        key: fn(&str, &str) -> String,
        encode: Encode,
    ) -> Ended {
        if rate <= 0.0 {
            return std::future::pending().await;
        }
        let mut ticks = interval(Duration::from_secs_f64(1.0 / rate));
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut sent = 0;
        loop {
            ticks.tick().await;
            let state = newest(self.handle, sent).await?;
            sent = state.sequence;
            let robots = &state.state.world.entities;
            let indices = match wanted {
                ALL => 0..robots.len(),
                name => state.state.entity(name).map_or(0..0, |(index, _)| index..index + 1),
            };
            for index in indices {
                if let Some((robot, payload)) = robots.get(index).zip(encode(&state, index)) {
                    self.notify(key(self.name, &robot.name), payload).await;
                }
            }
        }
    }

    async fn statistics(&self) -> Ended {
        let mut ticks = interval(STATISTICS);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            ticks.tick().await;
            let state = self.handle.newest();
            let message = to_proto::simulation::statistics(&state, &self.handle.statistics_at(&state));
            self.notify(keys::world_statistics(self.name), message.encode_to_vec()).await;
        }
    }

    async fn events(&self) -> Ended {
        let mut after = self.handle.events_after(u64::MAX).last_sequence;
        loop {
            let batch = self.handle.next_events(after, WAIT).await?;
            after = batch.last_sequence;
            let mut missed = batch.missed;
            for event in batch.events {
                let event = Some(to_proto::event::event(event));
                let message = v1::WatchEventsResponse { event, missed: std::mem::take(&mut missed) };
                self.notify(keys::events(self.name), message.encode_to_vec()).await;
            }
        }
    }

    async fn parameters(&self) -> Ended {
        let mut sent = 0;
        loop {
            let list = self.handle.next_parameters(sent, Some(UNCHANGED)).await?;
            sent = list.version;
            let message = to_proto::parameter::list(list.version, &list.parameters, &self.handle.newest());
            self.notify(keys::parameters(self.name), message.encode_to_vec()).await;
        }
    }

    async fn readings(&self, robot: &str, sensor: &str) -> Ended {
        let mut ticks = interval(SENSORS);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        // Numbers of the last published readings, by robot and sensor.
        let mut after: BTreeMap<(String, String), u64> = BTreeMap::new();
        loop {
            ticks.tick().await;
            let cursors = self.cursors(robot, sensor, &mut after)?;
            for cursors in cursors.chunks(MAX_WATCHED_SENSORS) {
                // A sensor deleted in the meantime is missing in the next round.
                let Ok(readings) = self.handle.readings_after(cursors) else { continue };
                for readings in readings.into_iter().filter(|readings| readings.batch.is_news()) {
                    let of = (readings.robot.clone(), readings.sensor.clone());
                    let key = keys::sensor_readings(self.name, &of.0, &of.1);
                    after.insert(of, readings.batch.after);
                    self.notify(key, to_proto::sensor::readings(readings).encode_to_vec()).await;
                }
            }
        }
    }

    /// Returns positions in the readings of each existing sensor that is subscribed to.
    fn cursors(
        &self,
        robot: &str,
        sensor: &str,
        after: &mut BTreeMap<(String, String), u64>,
    ) -> Result<Vec<SensorCursor>, CallError> {
        let (state, sensors) = self.handle.sensors(None)?;
        let robots = &state.state.world.entities;
        let mut there = BTreeMap::new();
        for (each, last) in &sensors {
            let Some(of) = robots.get(each.robot) else { continue };
            let is_wanted = |wanted: &str, name: &str| wanted == ALL || wanted == name;
            if is_wanted(robot, &of.name) && is_wanted(sensor, &each.definition.name) {
                // Late subscribers receive the newest reading.
                let names = (of.name.clone(), each.definition.name.clone());
                let from = after.get(&names).copied().unwrap_or_else(|| last.saturating_sub(1));
                there.insert(names, from);
            }
        }
        *after = there;
        let cursor = |((robot, sensor), after): (&(String, String), &u64)| SensorCursor {
            robot: robot.clone(),
            sensor: sensor.clone(),
            after: *after,
        };
        Ok(after.iter().map(cursor).collect())
    }
}
