//! The gRPC front-end: a request is parsed by `convert`, done by [`SimHandle`], and answered by `convert`.
//!
//! * [`simulation`], [`entity`], [`joint`], [`event`]: one file a service.
//! * [`control`]: the stream that controllers use.
//! * `incoming`: which connections are served.
//! * [`status`]: why a call is refused.
//! * [`transport`]: reasons for what tonic itself refuses.
//! * [`version`]: which clients are served.
//! * `health`: whether the daemon serves.

pub mod control;
pub mod entity;
pub mod event;
mod health;
mod incoming;
pub mod joint;
pub mod simulation;
pub mod status;
pub mod transport;
pub mod version;

use std::pin::Pin;
use std::time::Duration;

use simd_core::Command;
use simd_proto::v1::entity_service_server::EntityServiceServer;
use simd_proto::v1::event_service_server::EventServiceServer;
use simd_proto::v1::joint_service_server::JointServiceServer;
use simd_proto::v1::simulation_service_server::SimulationServiceServer;
use tokio::net::TcpListener;
use tokio_stream::Stream;
use tonic::Status;
use tonic::service::Routes;
use tonic::transport::Server;
use tonic::transport::server::TcpIncoming;
use tonic_health::pb::health_server::HealthServer;

use self::incoming::incoming;
use self::transport::Reasoned;
use self::version::Versioned;
use crate::SimHandle;
use crate::handle::{CallError, Done};

/// How long streams and calls may take to end once the daemon drains.
const DRAIN_GRACE: Duration = Duration::from_secs(2);
/// How often a silent connection is asked whether somebody is there, and how long it may take to answer.
const KEEPALIVE_INTERVAL: Duration = Duration::from_secs(20);
const KEEPALIVE_TIMEOUT: Duration = Duration::from_secs(20);
/// Connections at one time, which is well below the 1024 files that a process may
/// usually open; and how long one may take to begin.
const CONNECTIONS: incoming::Limits = incoming::Limits { connections: 512, preface: Duration::from_secs(5) };
/// Calls of one connection that are worked on at once; more are refused. Streams
/// count until they have begun.
const CALLS_PER_CONNECTION: usize = 1024;
/// Calls and streams that one connection may hold open; more wait at the client.
const STREAMS_PER_CONNECTION: u32 = 2048;

/// The answers of a stream.
type BoxStream<T> = Pin<Box<dyn Stream<Item = Result<T, Status>> + Send>>;

/// Serves until the daemon drains: then takes no more connections, lets every
/// stream end with OK, and returns when all calls have ended or after two seconds.
///
/// # Errors
/// Where the server itself fails; a connection that fails is that client's alone.
pub async fn serve(handle: SimHandle, listener: TcpListener) -> Result<(), tonic::transport::Error> {
    let accepted =
        TcpIncoming::from(listener).with_nodelay(Some(true)).with_keepalive(Some(KEEPALIVE_INTERVAL));
    let incoming = incoming(accepted, CONNECTIONS);
    // There is no timeout here, since it would cut streams; and windows are left
    // as they are, since small ones make h2 drop connections that carry small states.
    let server = Server::builder()
        .http2_keepalive_interval(Some(KEEPALIVE_INTERVAL))
        .http2_keepalive_timeout(Some(KEEPALIVE_TIMEOUT))
        .max_concurrent_streams(Some(STREAMS_PER_CONNECTION))
        .concurrency_limit_per_connection(CALLS_PER_CONNECTION)
        .load_shed(true)
        .add_routes(routes(&handle));
    let draining = handle.draining();
    let deadline = async {
        draining.cancelled().await;
        tokio::time::sleep(DRAIN_GRACE).await;
    };
    tokio::select! {
        served = server.serve_with_incoming_shutdown(incoming, draining.cancelled()) => served,
        () = deadline => {
            tracing::warn!("connections were still open {} s after draining began", DRAIN_GRACE.as_secs());
            Ok(())
        }
    }
}

/// All services, to be served alone or beside others on one port.
pub fn routes(handle: &SimHandle) -> Routes {
    let limit = usize::try_from(handle.info().limits.message_bytes).unwrap_or(usize::MAX);
    let simulation = simulation::Service::new(handle.clone());
    let entity = entity::Service::new(handle.clone());
    let joint = joint::Service::new(handle.clone());
    let event = event::Service::new(handle.clone());
    let routes = Routes::default()
        .add_service(checked(SimulationServiceServer::new(simulation).max_decoding_message_size(limit)))
        .add_service(checked(EntityServiceServer::new(entity).max_decoding_message_size(limit)))
        .add_service(checked(JointServiceServer::new(joint).max_decoding_message_size(limit)))
        .add_service(checked(EventServiceServer::new(event).max_decoding_message_size(limit)))
        .add_service(HealthServer::new(health::HealthService::new(handle.draining())));
    with_reflection(routes)
}

/// For clients of a fitting version, and with a reason for each refusal.
fn checked<S>(service: S) -> Versioned<Reasoned<S>> {
    Versioned(Reasoned(service))
}

/// Adds reflection in the version that tools use today and in the one before, which many still use.
fn with_reflection(routes: Routes) -> Routes {
    let schema = || {
        tonic_reflection::server::Builder::configure()
            .register_encoded_file_descriptor_set(simd_proto::v1::FILE_DESCRIPTOR_SET)
            .register_encoded_file_descriptor_set(tonic_health::pb::FILE_DESCRIPTOR_SET)
    };
    match (schema().build_v1(), schema().build_v1alpha()) {
        (Ok(v1), Ok(v1alpha)) => routes.add_service(v1).add_service(v1alpha),
        (Err(error), _) | (_, Err(error)) => {
            tracing::error!("the schema cannot be reflected: {error}");
            routes
        }
    }
}

/// Does a command once for each request id.
async fn command_once(handle: &SimHandle, request_id: &str, command: Command) -> Result<Done, CallError> {
    let doer = handle.clone();
    handle.once(request_id, async move { doer.command(command).await }).await
}

/// A question was answered with the answer to another one.
fn mismatched<T>(what: &T) -> CallError
where
    T: std::fmt::Debug,
{
    CallError::Internal { message: format!("this is no answer: {what:?}") }
}

#[cfg(test)]
mod tests;
