//! A daemon within the test's own process, on a free port of loopback.

use std::net::SocketAddr;

use simd_api::service;
use simd_client::{Client, proto};
use simd_server::config::{Config, Zenoh};
use simd_server::daemon::{self, Running};
use simd_world::handle::{RunState, Transport};

use crate::{json, web};

/// Transport between a client and the daemon: guarantees are the same over all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Via {
    /// Within the process: the services on the handle, and no network.
    Handle,
    /// Over gRPC.
    Grpc,
    /// Over gRPC-Web and HTTP/1.1, as from a browser.
    Web,
    /// In JSON over HTTP/1.1, as from curl.
    Json,
    /// Over Zenoh. Needs a runtime of the multi-thread flavor.
    Zenoh,
}

/// A daemon and a client of it. Dropping it ends the daemon's tasks with the test's runtime.
#[derive(Debug)]
pub struct Daemon {
    /// The client.
    pub client: Client,
    /// Transport of the client.
    pub via: Via,
    /// Address of the daemon's gRPC.
    pub address: SocketAddr,
    /// The running daemon, to drain it.
    pub running: Running,
}

impl Daemon {
    /// Starts a paused, empty world over gRPC, so that only `step` advances the time.
    pub async fn paused() -> Self {
        Self::paused_via(Via::Grpc).await
    }

    /// Like [`Self::paused`], over any transport.
    pub async fn paused_via(via: Via) -> Self {
        Self::start_via(via, |config| config.driver.state = RunState::Paused).await
    }

    /// Starts a daemon over gRPC after changing its configuration.
    ///
    /// # Panics
    /// Panics if it does not start: then the test has failed.
    pub async fn start(change: impl FnOnce(&mut Config)) -> Self {
        Self::start_via(Via::Grpc, change).await
    }

    /// Like [`Self::start`], over any transport.
    ///
    /// # Panics
    /// Panics if it does not start: then the test has failed.
    #[allow(clippy::panic, reason = "the test has failed")]
    pub async fn start_via(via: Via, change: impl FnOnce(&mut Config)) -> Self {
        let zenoh = if via == Via::Zenoh { Zenoh::on_free_port() } else { Zenoh::off() };
        let listen = SocketAddr::from(([127, 0, 0, 1], 0));
        let mut config = Config { listen, zenoh, ..Config::default() };
        change(&mut config);
        let running = daemon::start(config).await.unwrap_or_else(|error| panic!("{error}"));
        let client = another(via, &running).await;
        Self { client, via, address: running.address, running }
    }

    /// Returns another client with a separate connection.
    ///
    /// # Panics
    /// Panics if the daemon does not answer: then the test has failed.
    pub async fn another_client(&self) -> Client {
        another(self.via, &self.running).await
    }

    /// Does steps until this much simulated time has passed.
    ///
    /// # Panics
    /// Panics if the daemon refuses: then the test has failed.
    #[allow(clippy::panic, reason = "the test has failed")]
    pub async fn pass(&self, seconds: f64) {
        let time_step = self.client.physics().await.map_or(1e-3, |physics| physics.time_step);
        let steps = (seconds / time_step).round() as u64;
        self.client.step(steps).await.unwrap_or_else(|error| panic!("{error}"));
    }
}

#[allow(clippy::panic, reason = "the test has failed")]
async fn another(via: Via, running: &Running) -> Client {
    let endpoint = match via {
        Via::Handle => return Client::within(service::routes(&running.handle, Transport::Handle)),
        Via::Web => return web::client(running.address),
        Via::Json => return json::client(running.address),
        Via::Grpc => running.address.to_string(),
        Via::Zenoh => running.locators().first().cloned().unwrap_or_default(),
    };
    Client::connect(&endpoint).await.unwrap_or_else(|error| panic!("{error}"))
}

/// Returns a request for a robot with a fixed base under this name.
pub fn fixed(name: &str) -> proto::SpawnEntityRequest {
    proto::SpawnEntityRequest {
        name: name.into(),
        base: proto::Base::Fixed.into(),
        ..proto::SpawnEntityRequest::default()
    }
}
