//! Publications: states and poses of each robot, readings of sensors, pictures, statistics, events,
//! parameters. Each has a separate task, which publishes only while there is a subscriber; the physics thread
//! publishes nothing.
//!
//! A receiver that does not read loses publications: the newest wins, and a gap in the events shows in their
//! numbers.

mod pictures;
mod robots;
mod sensors;

use std::time::Duration;

use prost::Message;
use simd_proto::{keys, v1};
use tokio::sync::watch;
use tokio::time::{MissedTickBehavior, interval};
use tokio_util::sync::CancellationToken;
use zenoh::key_expr::KeyExpr;
use zenoh::pubsub::Publisher;
use zenoh::qos::CongestionControl;
use zenoh::sample::SourceInfo;
use zenoh::{Session, Wait as _};

use self::robots::OfRobots;
use super::Error;
use simd_api::convert::to_proto;
use simd_api::publication::{Encode, STATISTICS, UNCHANGED, joint_states, link_poses, newest};
use simd_world::SimHandle;
use simd_world::handle::CallError;

/// Longest wait of one look for events.
const WAIT: Duration = Duration::from_secs(60);

/// Publishes from now on. Each kind of publication is one line here.
pub(super) async fn serve(
    session: &Session,
    name: &str,
    handle: &SimHandle,
    state_rate: f64,
    ended: &CancellationToken,
) -> Result<(), Error> {
    let world = World { session: session.clone(), name: name.to_owned(), handle: handle.clone() };
    if state_rate > 0.0 {
        let period = Duration::from_secs_f64(1.0 / state_rate);
        let states = EachRobot { key: keys::joint_states, message: "JointStates", encode: joint_states };
        let poses = EachRobot { key: keys::link_poses, message: "GetLinkPosesResponse", encode: link_poses };
        for topic in [states, poses] {
            let demand = Demand::of(session, (topic.key)(name, "*"), topic.message).await?;
            let publish = publish_robots(world.clone(), topic, demand, period);
            tokio::spawn(ended.clone().run_until_cancelled_owned(publish));
        }
    }
    let readings = Demand::of(session, keys::sensor_readings(name, "*", "*"), sensors::MESSAGE).await?;
    tokio::spawn(ended.clone().run_until_cancelled_owned(sensors::publish(world.clone(), readings)));
    let pictures = Demand::of(session, keys::pictures(name, "*", "*"), pictures::MESSAGE).await?;
    tokio::spawn(ended.clone().run_until_cancelled_owned(pictures::publish(world, pictures)));
    let statistics = Demand::of(session, keys::world_statistics(name), "WorldStatistics").await?;
    tokio::spawn(ended.clone().run_until_cancelled_owned(publish_statistics(handle.clone(), statistics)));
    let events = Demand::of(session, keys::events(name), "WatchEventsResponse").await?;
    tokio::spawn(ended.clone().run_until_cancelled_owned(publish_events(handle.clone(), events)));
    let parameters = Demand::of(session, keys::parameters(name), "ParameterList").await?;
    tokio::spawn(ended.clone().run_until_cancelled_owned(publish_parameters(handle.clone(), parameters)));
    Ok(())
}

/// Source of every publishing task.
#[derive(Clone)]
struct World {
    session: Session,
    name: String,
    handle: SimHandle,
}

/// A kind of publication with a key for each robot.
struct EachRobot {
    key: fn(&str, &str) -> String,
    /// Name of the message in the schema.
    message: &'static str,
    encode: Encode,
}

async fn publish_robots(world: World, topic: EachRobot, mut demand: Demand, period: Duration) {
    let mut ticks = interval(period);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut publishers = OfRobots::default();
    let mut sent = 0;
    loop {
        if demand.wait().await {
            sent = 0;
        }
        ticks.tick().await;
        let Ok(state) = newest(&world.handle, sent).await else { return };
        sent = state.sequence;
        for robot in publishers.follow(&state.state.world) {
            let key = (topic.key)(&world.name, &robot.1);
            match publisher(&world.session, key, topic.message).await {
                Ok(publisher) => publishers.insert(robot, publisher),
                Err(error) => tracing::warn!(robot = robot.1, "cannot be published: {error}"),
            }
        }
        let wanted = publishers.iter().filter(|(_, publisher)| has_subscribers(publisher));
        let encoded =
            wanted.filter_map(|(robot, publisher)| Some((publisher, (topic.encode)(&state, robot)?)));
        put_all(encoded);
    }
}

async fn publish_statistics(handle: SimHandle, mut demand: Demand) {
    let mut ticks = interval(STATISTICS);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        demand.wait().await;
        ticks.tick().await;
        let state = handle.newest();
        let statistics = to_proto::simulation::statistics(&state, &handle.statistics_at(&state));
        put(&demand.publisher, statistics.encode_to_vec());
    }
}

/// Publishes events from the first subscription on, each as a message of `WatchEvents`.
async fn publish_events(handle: SimHandle, mut demand: Demand) {
    let mut after = 0;
    loop {
        if demand.wait().await {
            after = handle.events_after(u64::MAX).last_sequence;
        }
        let batch = match handle.next_events(after, WAIT).await {
            Ok(batch) => batch,
            Err(CallError::ShuttingDown) => return,
            Err(error) => return tracing::warn!("events are no longer published: {error}"),
        };
        after = batch.last_sequence;
        let mut missed = batch.missed;
        for event in batch.events {
            let event = Some(to_proto::event::event(event));
            let message = v1::WatchEventsResponse { event, missed: std::mem::take(&mut missed) };
            put(&demand.publisher, message.encode_to_vec());
        }
    }
}

/// Publishes all parameters whenever one changed.
async fn publish_parameters(handle: SimHandle, mut demand: Demand) {
    let mut sent = 0;
    loop {
        if demand.wait().await {
            sent = 0;
        }
        let Ok(list) = handle.next_parameters(sent, Some(UNCHANGED)).await else { return };
        sent = list.version;
        let message = to_proto::parameter::list(list.version, &list.parameters, &handle.newest());
        put(&demand.publisher, message.encode_to_vec());
    }
}

/// Demand for a key: whether it has a subscriber, which may use wildcards.
struct Demand {
    publisher: Publisher<'static>,
    is_there: watch::Receiver<bool>,
}

impl Demand {
    async fn of(session: &Session, key: String, message: &str) -> Result<Self, Error> {
        let publisher = publisher(session, key, message).await?;
        let (sender, is_there) = watch::channel(false);
        let before = sender.clone();
        let listener = publisher.matching_listener().callback(move |status| {
            sender.send_replace(status.matching());
        });
        listener.background().await.map_err(Error::session)?;
        // A subscriber may be older than the listener.
        let now = publisher.matching_status().await.map_err(Error::session)?.matching();
        before.send_if_modified(|is_there| !std::mem::replace(is_there, now | *is_there) && now);
        Ok(Self { publisher, is_there })
    }

    /// Waits for a subscriber; returns whether there was none before.
    async fn wait(&mut self) -> bool {
        let waited = !*self.is_there.borrow_and_update();
        if waited && self.is_there.wait_for(|is_there| *is_there).await.is_err() {
            // The listener ends with the session, and no subscriber will come.
            std::future::pending::<()>().await;
        }
        waited
    }
}

async fn publisher(session: &Session, key: String, message: &str) -> Result<Publisher<'static>, Error> {
    let key = KeyExpr::try_from(key).map_err(Error::session)?;
    let publisher = session.declare_publisher(key).encoding(keys::encoding(message)).express(true);
    publisher.congestion_control(CongestionControl::Drop).await.map_err(Error::session)
}

fn has_subscribers(publisher: &Publisher<'_>) -> bool {
    publisher.matching_status().wait().is_ok_and(|status| status.matching())
}

fn put(publisher: &Publisher<'static>, bytes: Vec<u8>) {
    put_all(std::iter::once((publisher, bytes)));
}

/// Publishes, and waits at most some milliseconds for each, while this thread's other tasks run on another
/// thread. They are moved once for all, since each move wakes a thread, or starts one if none is idle.
fn put_all<'p>(encoded: impl Iterator<Item = (&'p Publisher<'static>, Vec<u8>)>) {
    tokio::task::block_in_place(|| {
        for (publisher, bytes) in encoded {
            let source = SourceInfo::new(publisher.id(), 0);
            if let Err(error) = publisher.put(bytes).source_info(source).wait() {
                tracing::debug!("a publication is not sent: {error}");
            }
        }
    });
}
