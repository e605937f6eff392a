//! The front-end over a real connection: a daemon without its configuration, on a separate port.

mod control;
mod door;
mod draining;
mod idle;
mod incoming;
mod retries;
mod services;

use std::net::SocketAddr;
use std::sync::Arc;

use simd_core::PhysicsSettings;
use simd_core::Simulation;
use simd_core::simulation::WorldLimits;
use simd_proto::v1;
use simd_proto::v1::entity_service_client::EntityServiceClient;
use simd_proto::v1::event_service_client::EventServiceClient;
use simd_proto::v1::joint_service_client::JointServiceClient;
use simd_proto::v1::simulation_service_client::SimulationServiceClient;
use tokio::net::TcpListener;
use tokio::task::JoinHandle;
use tonic::Status;
use tonic::transport::{Channel, Endpoint};
use tonic_types::StatusExt as _;

use super::connections::Connections;
use super::listeners::Listeners;
use super::threads::FrontEndThreads;
use crate::config;
use simd_api::convert::test_world::spawn;
use simd_world::SimHandle;
use simd_world::blocking_threads::BlockingThreads;
use simd_world::driver;
use simd_world::handle::{DaemonInfo, DaemonLimits, RunState};
use simd_world::loading::Loader;

/// A daemon with one robot, `arm`, and a client's connection to it.
struct Daemon {
    handle: SimHandle,
    address: SocketAddr,
    channel: Channel,
    connections: Arc<Connections>,
    server: JoinHandle<()>,
}

impl Daemon {
    async fn start(state: RunState) -> Self {
        Self::start_with(state, config::Connections::default()).await
    }

    async fn start_with(state: RunState, connections: config::Connections) -> Self {
        Self::start_on(FrontEndThreads::of_this_runtime(), state, connections).await
    }

    async fn start_on(threads: FrontEndThreads, state: RunState, connections: config::Connections) -> Self {
        let limits = DaemonLimits::default();
        let world = Simulation::new(PhysicsSettings::default(), WorldLimits::default());
        let driver = driver::start(world, driver::Config { state, ..Default::default() }).unwrap();
        let info = DaemonInfo { name: "test".into(), version: "0.0.0", limits };
        let handle = SimHandle::new(
            driver,
            Loader::new(limits, &[], BlockingThreads::computing().unwrap()).unwrap(),
            info,
        );
        handle.command(spawn("arm", &[])).await.unwrap();
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let connections = Connections::new(connections, Arc::default());
        let (served, within) = (handle.clone(), Arc::clone(&connections));
        let server = threads.door().clone().spawn(async move {
            let listeners = Listeners { tcp: listener, unix: None };
            super::serve_within(&within, threads, served, listeners, None, Default::default()).await;
        });
        let channel = Endpoint::from_shared(format!("http://{address}")).unwrap().connect().await.unwrap();
        Self { handle, address, channel, connections, server }
    }

    fn simulation(&self) -> SimulationServiceClient<Channel> {
        SimulationServiceClient::new(self.channel.clone())
    }

    fn entities(&self) -> EntityServiceClient<Channel> {
        EntityServiceClient::new(self.channel.clone())
    }

    fn joints(&self) -> JointServiceClient<Channel> {
        JointServiceClient::new(self.channel.clone())
    }

    fn events(&self) -> EventServiceClient<Channel> {
        EventServiceClient::new(self.channel.clone())
    }
}

impl Drop for Daemon {
    fn drop(&mut self) {
        self.handle.draining().cancel();
        self.handle.end_driver();
    }
}

fn reason(status: &Status) -> String {
    status.get_details_error_info().unwrap().reason
}

fn shoulder() -> v1::JointSelection {
    v1::JointSelection { robot: "arm".into(), joints: vec!["shoulder".into()] }
}

/// Returns the shoulder's target, for one robot.
fn move_shoulder(robot: &str, position: f64) -> Vec<v1::RobotTargets> {
    let target = v1::PositionTarget { position, ..Default::default() };
    let target = v1::JointTarget {
        joint: "shoulder".into(),
        axis: 0,
        target: Some(v1::joint_target::Target::Position(target)),
    };
    vec![v1::RobotTargets { robot: robot.into(), joints: vec![target], ..Default::default() }]
}

fn sequence(states: &v1::JointStates) -> u64 {
    states.stamp.as_ref().unwrap().sequence
}
