//! Pictures of cameras at their own rate: each camera has a key for its pictures. A subscription makes
//! renderers draw them.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use prost::Message as _;
use simd_proto::keys;
use tokio::time::{MissedTickBehavior, interval};
use zenoh::pubsub::Publisher;

use super::{Demand, World, has_subscribers, publisher, put_all};
use simd_api::convert::to_proto;

/// Name of the message in the schema.
pub(super) const MESSAGE: &str = "CameraPicture";
/// Time between two looks for new pictures.
const PERIOD: Duration = Duration::from_millis(10);

/// A camera's key.
struct Topic {
    publisher: Publisher<'static>,
    /// Number of the last published picture; 0 without a subscriber.
    after: u64,
}

/// Publishes while it is polled.
pub(super) async fn publish(world: World, mut demand: Demand) {
    let mut ticks = interval(PERIOD);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut topics: BTreeMap<u64, Topic> = BTreeMap::new();
    loop {
        demand.wait().await;
        ticks.tick().await;
        let cameras = world.handle.cameras_by_id();
        let there: BTreeSet<u64> = cameras.iter().map(|(id, _)| *id).collect();
        topics.retain(|id, _| there.contains(id));
        let mut pictures = Vec::new();
        for (id, name) in cameras {
            if let Entry::Vacant(entry) = topics.entry(id) {
                let key = keys::pictures(&world.name, &name.robot, &name.sensor);
                match publisher(&world.session, key, MESSAGE).await {
                    Ok(publisher) => {
                        entry.insert(Topic { publisher, after: 0 });
                    }
                    Err(error) => {
                        tracing::warn!(
                            robot = name.robot,
                            sensor = name.sensor,
                            "cannot be published: {error}"
                        );
                    }
                }
            }
            let Some(topic) = topics.get_mut(&id) else { continue };
            if !has_subscribers(&topic.publisher) {
                topic.after = 0;
            } else if let Some(picture) = world.handle.followed_picture(id, topic.after) {
                topic.after = picture.sequence;
                pictures.push((id, picture));
            }
        }
        if pictures.is_empty() {
            continue;
        }
        put_all(pictures.iter().filter_map(|(id, picture)| {
            Some((&topics.get(id)?.publisher, to_proto::camera::picture(picture).encode_to_vec()))
        }));
    }
}
