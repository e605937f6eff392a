//! The gRPC front-end: the services over HTTP/2, with health and reflection, and the browser's routes, on one
//! port.
//!
//! * `listeners`: the port and the Unix socket. `tls`: a connection before HTTP. `incoming`: arriving
//!   connections. `connections`: selection and duration of served ones.
//! * `threads`: the threads that serve them.
//! * `calls`: effects of each call on its connection; `activity`: the connection's idleness.
//! * `health`: whether the daemon serves.

mod activity;
mod calls;
mod connections;
mod deadline;
mod health;
mod incoming;
mod listeners;
mod socket_names;
#[cfg(test)]
mod tests;
mod threads;
mod tls;

use std::convert::Infallible;
use std::io;
use std::sync::Arc;
use std::time::Duration;

use axum::http::header::{self, HeaderValue};
use axum::middleware;
use futures_util::FutureExt as _;
use tokio::net::UnixStream;
use tokio_stream::StreamExt as _;
use tokio_util::task::TaskTracker;
use tonic::service::{InterceptorLayer, Routes};
use tonic::transport::Server;
use tonic_health::pb::health_server::HealthServer;

use self::connections::Connections;
use self::incoming::{Connection, FirstRequest, accept, first_request};
pub use self::listeners::{Listeners, UnixSocket, listen};
use self::listeners::{Movable as _, accepted};
pub use self::threads::FrontEndThreads;
pub use self::tls::Tls;
use self::tls::Wire;
use crate::config::Connections as DaemonLimits;
use crate::http;
use simd_api::service::routes;
use simd_world::SimHandle;
use simd_world::handle::Transport;

/// Maximum time for streams and calls to end once the daemon drains.
const DRAIN_GRACE: Duration = Duration::from_secs(2);
/// Time of silence before a ping, and for its answer.
const KEEPALIVE_INTERVAL: Duration = Duration::from_secs(20);
const KEEPALIVE_TIMEOUT: Duration = Duration::from_secs(20);

/// Serves until the daemon drains. Then it accepts no more connections, lets every stream end with OK, and
/// returns when all calls have ended or after two seconds. It is spawned on the door of the threads.
pub async fn serve(
    threads: FrontEndThreads,
    handle: SimHandle,
    listeners: Listeners,
    tls: Option<Arc<Tls>>,
    page: http::Settings,
    limits: DaemonLimits,
) {
    let connections = Connections::new(limits, handle.refused_unanswered());
    serve_within(&connections, threads, handle, listeners, tls, page).await;
}

async fn serve_within(
    connections: &Arc<Connections>,
    threads: FrontEndThreads,
    handle: SimHandle,
    listeners: Listeners,
    tls: Option<Arc<Tls>>,
    page: http::Settings,
) {
    let draining = handle.draining();
    let limits = *connections.limits();
    let (server, health) = servers(&handle, page, limits);
    let threads = Arc::new(threads);
    let serving = TaskTracker::new();
    let Listeners { tcp, mut unix } = match listeners.moved_here() {
        Ok(listeners) => listeners,
        Err(error) => return tracing::error!("connections cannot be accepted: {error}"),
    };
    let from_tcp = accept(accepted(tcp), connections, &draining, |io, slot, address| {
        let (server, health, tls) = (server.clone(), health.clone(), tls.clone());
        let (threads, served) = (Arc::clone(&threads), serving.clone());
        serving.spawn(async move {
            if tls.is_none() {
                match slot.cut.run_until_cancelled(first_request(&io, limits.begin)).await {
                    Some(FirstRequest::Health) => {
                        let wire = Wire::new(io, None);
                        return health.serve(Ok(Connection::new(wire, slot, address))).await;
                    }
                    Some(FirstRequest::Other) => {}
                    None | Some(FirstRequest::Nothing) => return,
                }
            }
            threads.serve(&served, async move {
                let wire = io.moved_here().map(|io| Wire::new(io, tls.as_deref()));
                server.serve(wire.map(|wire| Connection::new(wire, slot, address))).await;
            });
        });
    });
    let from_unix = async {
        let Some(socket) = &mut unix else { return std::future::pending().await };
        let serve = |io: UnixStream, slot, address| {
            let server = server.clone();
            threads.serve(&serving, async move {
                let wire = io.moved_here().map(Wire::of_socket);
                server.serve(wire.map(|wire| Connection::new(wire, slot, address))).await;
            });
        };
        accept(socket.accepted(), connections, &draining, serve).await;
    };
    tokio::select! {
        () = from_tcp => {}
        () = from_unix => {}
        () = connections.close_idle() => {}
        () = draining.cancelled() => {}
    }
    serving.close();
    if tokio::time::timeout(DRAIN_GRACE, serving.wait()).await.is_err() {
        tracing::warn!("connections were still open {} s after draining began", DRAIN_GRACE.as_secs());
    }
}

/// Returns the server for the calls of each connection, and the server for health checks at the door. The
/// latter serves a connection's first request only, since the next may be any.
fn servers(handle: &SimHandle, page: http::Settings, limits: DaemonLimits) -> (Served, Served) {
    let services = with_reflection(with_health(routes(handle, Transport::Grpc), handle));
    let routes = http::beside(services.into_axum_router(), handle, page);
    let closes = |mut response: axum::response::Response| async {
        response.headers_mut().insert(header::CONNECTION, HeaderValue::from_static("close"));
        response
    };
    let first = routes.clone().layer(middleware::map_response(closes));
    (Served::new(routes, handle, limits), Served::new(first, handle, limits))
}

/// Routes of a connection, and its limits.
#[derive(Clone)]
struct Served {
    routes: Routes,
    limits: DaemonLimits,
}

impl Served {
    fn new(routes: axum::Router, handle: &SimHandle, limits: DaemonLimits) -> Self {
        let followed = middleware::from_fn_with_state((limits, handle.clone()), calls::follow);
        Self { routes: routes.layer(followed).into(), limits }
    }

    /// Serves one connection until it ends. tonic ends connections (in HTTP/2 by GOAWAY) all at once, with
    /// its server: so each has a separate server.
    async fn serve(self, connection: io::Result<Connection<Wire>>) {
        let connection = match connection {
            Ok(connection) => connection,
            Err(error) => return tracing::error!("a connection cannot be served: {error}"),
        };
        let (end, ended) = (connection.end(), connection.ended());
        let one = tokio_stream::once(Ok::<_, Infallible>(connection));
        // The server ends its connections once no more will follow.
        let no_more = ended.cancelled_owned().into_stream().filter_map(|()| None);
        let incoming = one.chain(no_more);
        // Without a timeout, which would cut streams. Windows keep their defaults, since small ones make h2
        // drop connections that carry small states.
        let server = Server::builder()
            .http2_keepalive_interval(Some(KEEPALIVE_INTERVAL))
            .http2_keepalive_timeout(Some(KEEPALIVE_TIMEOUT))
            .max_concurrent_streams(Some(self.limits.open_calls))
            .concurrency_limit_per_connection(self.limits.calls)
            .load_shed(true)
            .accept_http1(true)
            .layer(InterceptorLayer::new(deadline::note))
            .add_routes(self.routes);
        if let Err(error) = server.serve_with_incoming_shutdown(incoming, end.cancelled()).await {
            tracing::error!("a connection cannot be served: {error}");
        }
    }
}

/// Adds the standard health service.
fn with_health(routes: Routes, handle: &SimHandle) -> Routes {
    routes.add_service(HealthServer::new(health::HealthService::new(handle.clone())))
}

/// Adds reflection in its present version, and in the previous one, which many tools still use.
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
