//! A node on a ROS 2 graph with the middleware `rmw_zenoh`: other nodes see simd as a normal driver. It needs
//! no ROS.
//!
//! * Here: from the start to the drain.
//! * `calls`: limit of simultaneous queries.
//! * `connection`: a Zenoh session to the graph's router, which may disappear and return.
//! * `endpoints`: publishers, subscriptions and servers in the form of `rmw_zenoh`.
//! * `names`: names of robots. `robots`: topics and frames of robots, and the messages of a state. `sensors`: those of sensors,
//!   `cameras`: those of cameras.
//! * `publications`: the published messages.
//! * `commands`: the subscriptions.
//! * `services`: `simulation_interfaces`. `actions`: `FollowJointTrajectory`.
//!
//! It reads published states and sends commands like any client: only its own tasks wait for it.

mod actions;
mod calls;
mod cameras;
mod commands;
mod connection;
mod endpoints;
mod names;
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
use simd_world::account::Account;
use simd_world::handle::{CallContext, Caller, Transport};

/// Longest wait for the node to leave the graph after a drain; then it is left behind.
const CLOSE: Duration = Duration::from_millis(500);

/// The running node.
#[derive(Debug)]
pub struct Serving {
    ended: CancellationToken,
    node: JoinHandle<()>,
}

/// Name of the graph's nodes, as a client of simd.
const CLIENT: &str = "ros2";
/// Maximum number of queries in progress.
const CALLS: usize = 32;
/// Maximum number of queries that wait for the end of a goal: each goal of each robot has room for one.
const WAITING_CALLS: usize = robots::MAX_ROBOTS * actions::GOALS;

/// Joins the graph, now or as soon as its router answers.
///
/// # Errors
/// Returns an error if the system refuses threads.
pub fn start(settings: Ros2, handle: &SimHandle) -> std::io::Result<Serving> {
    let calls = [Calls::new(CALLS)?, Calls::new(WAITING_CALLS)?];
    let ended = CancellationToken::new();
    // All nodes of the graph are one client.
    let caller = Caller::said(CLIENT, Transport::Zenoh);
    let account = Account::Session(CLIENT.into());
    let call = CallContext { caller, transport: Transport::Zenoh, ..CallContext::of(account) };
    let node = tokio::spawn(serve(settings, handle.of_call(call), calls, ended.clone()));
    Ok(Serving { ended, node })
}

async fn serve(settings: Ros2, handle: SimHandle, calls: [Calls; 2], ended: CancellationToken) {
    let Some(session) = ended.run_until_cancelled(connection::open(&settings)).await else { return };
    let session = match session {
        Ok(session) => session,
        Err(sentence) => return tracing::error!("the node of ROS 2 cannot start: {sentence}"),
    };
    let node = async {
        let graph = Arc::new(Graph::join(session.clone(), &settings, &handle.info().name, calls).await?);
        tracing::info!(router = settings.router, domain = settings.domain_id, "a node of ROS 2");
        let _services = services::serve(&graph, &handle).await?;
        publications::publish(&graph, &handle, &settings).await
    };
    if let Some(Err(error)) = ended.run_until_cancelled(node).await {
        tracing::error!("the node of ROS 2 ends: {error}");
    }
    if tokio::time::timeout(CLOSE, session.close()).await.is_err() {
        tracing::warn!("the session of ROS 2 did not close in time and was abandoned");
    }
}

impl Serving {
    /// Leaves the graph.
    pub async fn drain(self) {
        self.ended.cancel();
        if tokio::time::timeout(2 * CLOSE, self.node).await.is_err() {
            tracing::warn!("the node of ROS 2 did not end in time and was abandoned");
        }
    }
}
