//! A daemon within the test's own process, on a free port of loopback.

use std::net::SocketAddr;

use simd_client::{Client, proto};
use simd_server::config::Config;
use simd_server::daemon::{self, Running};
use simd_server::handle::RunState;

/// A daemon and a client of it. Dropping it ends the daemon's tasks with the test's runtime.
#[derive(Debug)]
pub struct Daemon {
    /// The client.
    pub client: Client,
    /// Where the daemon listens.
    pub address: SocketAddr,
    /// To drain it.
    pub running: Running,
}

impl Daemon {
    /// An empty world that is paused, so that time passes by `step` alone.
    pub async fn paused() -> Self {
        Self::start(|config| config.driver.state = RunState::Paused).await
    }

    /// A daemon whose configuration is changed first.
    ///
    /// # Panics
    /// Where it does not start: then the test has failed.
    #[allow(clippy::panic, reason = "the test has failed")]
    pub async fn start(change: impl FnOnce(&mut Config)) -> Self {
        let mut config = Config { listen: SocketAddr::from(([127, 0, 0, 1], 0)), ..Config::default() };
        change(&mut config);
        let running = daemon::start(config).await.unwrap_or_else(|error| panic!("{error}"));
        let address = running.address;
        let client = Client::connect(&address.to_string()).await.unwrap_or_else(|error| panic!("{error}"));
        Self { client, address, running }
    }

    /// Does steps until this much simulated time has passed.
    ///
    /// # Panics
    /// Where the daemon refuses: then the test has failed.
    #[allow(clippy::panic, reason = "the test has failed")]
    pub async fn pass(&self, seconds: f64) {
        let time_step = self.client.physics().await.map_or(1e-3, |physics| physics.time_step);
        let steps = (seconds / time_step).round() as u64;
        self.client.step(steps).await.unwrap_or_else(|error| panic!("{error}"));
    }
}

/// A request for a robot with a fixed base under this name.
pub fn fixed(name: &str) -> proto::SpawnEntityRequest {
    proto::SpawnEntityRequest {
        name: name.into(),
        base: proto::Base::Fixed.into(),
        ..proto::SpawnEntityRequest::default()
    }
}
