//! Readers of states, events and parameters, over every transport, and the age of the states.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use prost::Message as _;
use simd_client::proto::{ControlWait, JointStates};
use simd_client::{Client, ControlOptions, Error};
use tokio::task::JoinSet;
use tokio::time::timeout;
use zenoh::handlers::RingChannel;

use super::Stage;
use crate::network;

const SECOND: Duration = Duration::from_secs(1);
/// Time between two states of a reader: the readers share the machine with the daemon.
const PERIOD: Duration = Duration::from_millis(50);
const NAMES: [&str; 3] = ["grpc", "zenoh", "web"];

/// Starts this many, over each transport in turn; the last is a subscriber.
pub(super) fn start(stage: &Stage, readers: usize, actors: &mut JoinSet<()>) {
    for number in 0..readers.saturating_sub(1) {
        let stage = stage.clone();
        actors.spawn(async move {
            let name = NAMES[number % NAMES.len()];
            while stage.is_on() {
                let Some(client) = stage.tally.note("connect", stage.client(number).await) else {
                    // It is refused, or not answered in its time.
                    tokio::time::sleep(PERIOD).await;
                    continue;
                };
                let read = match number / NAMES.len() % 3 {
                    0 => control(&stage, &client, name).await,
                    1 => next_states(&stage, &client).await,
                    _ => events_and_parameters(&stage, &client).await,
                };
                stage.tally.note("reading", read);
            }
        });
    }
    let stage = stage.clone();
    actors.spawn(async move { subscribe(&stage).await });
}

fn note_age(stage: &Stage, transport: &'static str, states: &JointStates) {
    let wall = states.stamp.and_then(|stamp| stamp.wall_time).unwrap_or_default();
    let published = Duration::new(wall.seconds.unsigned_abs(), wall.nanos.unsigned_abs());
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    stage.tally.age(transport, now.saturating_sub(published));
}

/// Each state newer than the last, as a controller reads.
async fn control(stage: &Stage, client: &Client, transport: &'static str) -> Result<(), Error> {
    let wait = ControlWait::NewerState;
    let options = ControlOptions { wait, timeout: Some(SECOND), ..ControlOptions::default() };
    let mut control = client.control(options).await?;
    for _ in 0..2_000 {
        if !stage.is_on() {
            break;
        }
        let states = control.next().await?.accepted()?;
        note_age(stage, transport, &states);
        tokio::time::sleep(PERIOD).await;
    }
    Ok(())
}

async fn next_states(stage: &Stage, client: &Client) -> Result<(), Error> {
    let mut sequence = 0;
    for _ in 0..1_000 {
        if !stage.is_on() {
            break;
        }
        let states = client.next_states(sequence, SECOND, Vec::new()).await?;
        sequence = states.stamp.map_or(0, |stamp| stamp.sequence);
        tokio::time::sleep(PERIOD).await;
    }
    Ok(())
}

async fn events_and_parameters(stage: &Stage, client: &Client) -> Result<(), Error> {
    let mut events = client.watch_events(0).await?;
    let mut parameters = client.watch_parameters().await?;
    let mut states = client.watch(Vec::new(), 20.0).await?;
    let begun = std::time::Instant::now();
    while stage.is_on() && begun.elapsed() < 30 * SECOND {
        let next = async {
            tokio::select! {
                event = events.next() => event.map(drop),
                list = parameters.next() => list.map(drop),
                states = states.next() => states.map(drop),
            }
        };
        match timeout(SECOND, next).await {
            Ok(read) => read?,
            Err(_quiet) => {}
        }
    }
    Ok(())
}

/// A program that knows only the keys.
async fn subscribe(stage: &Stage) {
    let session = network::session("client", &stage.locator).await;
    let states = session.declare_subscriber("simd/soak/joint_states/*").with(RingChannel::new(1)).await;
    let Ok(states) = states else { return stage.tally.fail("no subscription to Zenoh".to_owned()) };
    while stage.is_on() {
        let Ok(Ok(sample)) = timeout(SECOND, states.recv_async()).await else { continue };
        if let Ok(states) = JointStates::decode(&*sample.payload().to_bytes()) {
            note_age(stage, "subscriber", &states);
        }
    }
}
