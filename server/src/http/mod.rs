//! The HTTP front-end: the page in the browser and its data, on the port of gRPC.
//!
//! * Here: the routes.
//! * `guard`: access checks for browsers, and their security headers.
//! * `login`: the page's token, and the client that a request counts for.
//! * `api_page`: the methods as OpenAPI, and a page to try them.
//! * `bundle`: the page itself. `fallback` has the simpler page.
//! * `files`: meshes, colliders and files by their hash; the former two as glTF.
//! * `robots`: robots as JSON and as URDF.
//! * `metrics`: endpoints for operators.
//! * `caching`: caching by browsers.
//!
//! Its own routes change nothing: the page speaks gRPC-Web, and other programs JSON, which call the same services. No path of a
//! request is ever joined to a path of a disk. Files are looked up by their hash, and the page's files in a
//! table.

mod api_page;
mod bundle;
mod caching;
mod files;
mod guard;
mod login;
mod metrics;
mod robots;
#[cfg(test)]
mod tests;
mod ways;

use std::sync::Arc;

use axum::Router;
use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::{Method, Response, StatusCode, header};
use axum::middleware;
use axum::response::IntoResponse;
use axum::routing::{get, post};
use tonic::Status;
use tonic_web::GrpcWebLayer;

pub use self::bundle::Bundle;
pub use self::guard::{FrameAncestors, Hosts};
pub use self::ways::ZenohWays;

use crate::connect::JsonLayer;
use simd_world::SimHandle;
use simd_world::handle::CallError;

/// Settings of the front-end.
#[derive(Clone, Debug, Default)]
pub struct Settings {
    /// The page.
    pub bundle: Bundle,
    /// Names by which the daemon may be addressed.
    pub hosts: Hosts,
    /// Sites that may show the page in a frame.
    pub frame_ancestors: FrameAncestors,
    /// Whether connections are TLS.
    pub is_tls: bool,
    /// Locators of Zenoh at which the daemon is reached.
    pub zenoh: ZenohWays,
}

/// State shared by the routes.
#[derive(Debug)]
struct Page {
    handle: SimHandle,
    bundle: Bundle,
    is_tls: bool,
    /// Locators as `ways` lists them.
    zenoh: ZenohWays,
}

/// Adds the page and its data to the services, which browsers call as gRPC-Web.
pub(crate) fn beside(services: Router, handle: &SimHandle, settings: Settings) -> Router {
    let Settings { bundle, hosts, frame_ancestors, is_tls, zenoh } = settings;
    let page = Arc::new(Page { handle: handle.clone(), bundle, is_tls, zenoh: zenoh.for_everyone() });
    Router::new()
        .route("/meshes/{name}", get(files::mesh))
        .route("/colliders/{name}", get(files::collider))
        .route("/metrics", get(metrics::metrics))
        .route("/robots", get(robots::list))
        .route("/robots/{robot}/robot.urdf", get(robots::description))
        .route_layer(middleware::from_fn_with_state(handle.clone(), login::check))
        .route("/assets/{*name}", get(files::asset))
        .route("/.well-known/simd.json", get(ways::ways))
        .route("/openapi.json", get(api_page::openapi))
        .route("/api", get(api_page::moved))
        .route("/api/", get(api_page::page))
        .route("/api/api.js", get(api_page::script))
        .route("/api/api.css", get(api_page::style))
        .route("/healthz", get(metrics::health))
        .route("/readyz", get(metrics::readiness))
        .route("/login", post(login::log_in).delete(login::log_out))
        .fallback(other)
        .with_state(page)
        // Only on the services: elsewhere it refuses other requests than gRPC.
        .merge(services.route_layer(GrpcWebLayer::new()).route_layer(JsonLayer).reset_fallback())
        .layer(middleware::from_fn_with_state((hosts, frame_ancestors), guard::guard))
}

/// Returns a file of the page, or 404.
async fn other(State(page): State<Arc<Page>>, request: Request) -> Response<Body> {
    let media = request.headers().get(header::CONTENT_TYPE);
    if media.is_some_and(|media| media.as_bytes().starts_with(b"application/grpc")) {
        let message = format!("there is no service at {}", request.uri().path());
        return Status::unimplemented(message).into_http();
    }
    let path = request.uri().path().strip_prefix('/').unwrap_or_default();
    let file = page.bundle.answer(path, request.headers());
    match file.filter(|_| [Method::GET, Method::HEAD].contains(request.method())) {
        Some(file) => file,
        None => (StatusCode::NOT_FOUND, "there is nothing at this address\n").into_response(),
    }
}

/// Returns an error as an HTTP answer, for files of robots and for robots.
fn refused(error: &CallError) -> Response<Body> {
    let status = match error {
        CallError::World(_) | CallError::FileNotFound { .. } => StatusCode::NOT_FOUND,
        CallError::LimitExceeded { .. } | CallError::ShuttingDown => StatusCode::SERVICE_UNAVAILABLE,
        _ => StatusCode::INTERNAL_SERVER_ERROR,
    };
    (status, format!("{error}\n")).into_response()
}
