//! A node on a graph of ROS 2 whose middleware is `rmw_zenoh`: to other nodes simd is a driver like any. No ROS is needed.
//!
//! * Here: from the start to the drain.
//! * `calls`: queries that are answered at one time.
//! * `connection`: a session of Zenoh to the graph's router, which comes and goes as it likes.
//! * `endpoints`: publishers, subscriptions and servers as `rmw_zenoh` has them.
//! * `robots`: which robot has which topics and frames, and the messages of a state. `sensors`: the same of sensors, `cameras`: of
//!   their pictures.
//! * `publications`: what is published.
//! * `commands`: what is subscribed to.
//! * `services`: `simulation_interfaces`. `actions`: `FollowJointTrajectory`.
//!
//! Everything here reads published states and sends commands like any client: nothing waits for it but its own tasks.

mod actions;
mod calls;
mod cameras;
mod commands;
mod connection;
mod endpoints;
mod publications;
mod robots;
mod sensors;
mod services;
#[cfg(test)]
mod tests;

use std::sync::Arc;
use std::time::Duration;

use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;

use self::calls::Calls;
use self::endpoints::Graph;
use crate::config::Ros2;
use simd_world::SimHandle;

/// The node leaves the graph within this time of a drain, or is left behind.
const CLOSE: Duration = Duration::from_millis(500);

/// The node while it is served.
#[derive(Debug)]
pub struct Serving {
    ended: CancellationToken,
    node: JoinHandle<()>,
}

/// Queries that are worked on at one time.
const CALLS: usize = 32;
/// Queries that wait for the end of a goal: each goal of each robot has room for one.
const WAITING_CALLS: usize = robots::MAX_ROBOTS * actions::GOALS;

/// Joins the graph, now or as soon as its router is there.
///
/// # Errors
/// Returns an error if the system gives no threads.
pub fn start(settings: Ros2, handle: &SimHandle) -> std::io::Result<Serving> {
    let calls = [Calls::new(CALLS)?, Calls::new(WAITING_CALLS)?];
    let ended = CancellationToken::new();
    let node = tokio::spawn(serve(settings, handle.clone(), calls, ended.clone()));
    Ok(Serving { ended, node })
}

async fn serve(settings: Ros2, handle: SimHandle, calls: [Calls; 2], ended: CancellationToken) {
    let Some(session) = ended.run_until_cancelled(connection::open(&settings)).await else { return };
    let session = match session {
        Ok(session) => session,
        Err(sentence) => return tracing::error!("there is no node of ROS 2: {sentence}"),
    };
    let node = async {
        let graph = Arc::new(Graph::join(session.clone(), &settings, &handle.info().name, calls).await?);
        tracing::info!(router = settings.router, domain = settings.domain_id, "a node of ROS 2");
        let _services = services::serve(&graph, &handle).await?;
        publications::publish(&graph, &handle, settings.rate).await
    };
    if let Some(Err(error)) = ended.run_until_cancelled(node).await {
        tracing::error!("the node of ROS 2 ends: {error}");
    }
    if tokio::time::timeout(CLOSE, session.close()).await.is_err() {
        tracing::warn!("the session of ROS 2 does not close in time and is left behind");
    }
}

impl Serving {
    /// Leaves the graph.
    pub async fn drain(self) {
        self.ended.cancel();
        if tokio::time::timeout(2 * CLOSE, self.node).await.is_err() {
            tracing::warn!("the node of ROS 2 does not end in time and is left behind");
        }
    }
}
