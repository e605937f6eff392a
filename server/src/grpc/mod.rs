//! The gRPC front-end: the services over HTTP/2, on one port with health and reflection, and
//! beside them what browsers get.
//!
//! * `incoming`: which connections are served.
//! * `health`: whether the daemon serves.

mod health;
mod incoming;
#[cfg(test)]
mod tests;

use std::time::Duration;

use tokio::net::TcpListener;
use tonic::service::Routes;
use tonic::transport::Server;
use tonic::transport::server::TcpIncoming;
use tonic_health::pb::health_server::HealthServer;

use self::incoming::incoming;
use crate::SimHandle;
use crate::handle::Transport;
use crate::http;
use crate::service::routes;

/// How long streams and calls may take to end once the daemon drains.
const DRAIN_GRACE: Duration = Duration::from_secs(2);
/// How often a silent connection is asked whether somebody is there, and how long it may take to answer.
const KEEPALIVE_INTERVAL: Duration = Duration::from_secs(20);
const KEEPALIVE_TIMEOUT: Duration = Duration::from_secs(20);
/// Connections at one time, which is well below the 1024 files that a process may
/// usually open; how long one may take to begin; and how many of them may be browsers'.
const CONNECTIONS: incoming::ConnectionLimits = incoming::ConnectionLimits {
    connections: 512,
    preface: Duration::from_secs(5),
    http1: 192,
    http1_silence: Duration::from_secs(600),
};
/// Calls of one connection that are worked on at once; more are refused. Streams
/// count until they have begun.
const CALLS_PER_CONNECTION: usize = 1024;
/// Calls and streams that one connection may hold open; more wait at the client.
const STREAMS_PER_CONNECTION: u32 = 2048;

/// Serves until the daemon drains: then takes no more connections, lets every
/// stream end with OK, and returns when all calls have ended or after two seconds.
///
/// # Errors
/// Where the server itself fails; a connection that fails is that client's alone.
pub async fn serve(
    handle: SimHandle,
    listener: TcpListener,
    page: http::Settings,
) -> Result<(), tonic::transport::Error> {
    let accepted =
        TcpIncoming::from(listener).with_nodelay(Some(true)).with_keepalive(Some(KEEPALIVE_INTERVAL));
    let incoming = incoming(accepted, CONNECTIONS);
    let services = with_reflection(with_health(routes(&handle, Transport::Grpc), &handle));
    // There is no timeout here, since it would cut streams; and windows are left
    // as they are, since small ones make h2 drop connections that carry small states.
    let server = Server::builder()
        .http2_keepalive_interval(Some(KEEPALIVE_INTERVAL))
        .http2_keepalive_timeout(Some(KEEPALIVE_TIMEOUT))
        .max_concurrent_streams(Some(STREAMS_PER_CONNECTION))
        .concurrency_limit_per_connection(CALLS_PER_CONNECTION)
        .load_shed(true)
        .accept_http1(true)
        .add_routes(http::beside(services.into_axum_router(), &handle, page).into());
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

/// Adds the standard health service.
fn with_health(routes: Routes, handle: &SimHandle) -> Routes {
    routes.add_service(HealthServer::new(health::HealthService::new(handle.draining())))
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
