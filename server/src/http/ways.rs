//! `/.well-known/simd.json`: how clients that do not speak HTTP reach the daemon of this port. Everyone may read it.

use std::sync::Arc;

use axum::body::Body;
use axum::extract::State;
use axum::http::{HeaderValue, Response, header};
use axum::response::IntoResponse as _;
use serde::Serialize;

use super::Page;

/// Maximum number of locators in the document.
const MAX_LOCATORS: usize = 16;

/// The document.
#[derive(Serialize)]
struct Ways<'a> {
    name: &'a str,
    version: &'a str,
    /// Address at which the daemon listens.
    zenoh: &'a [String],
    /// Routers that it joins.
    routers: &'a [String],
}

/// Locators of Zenoh by which a daemon is reached.
#[derive(Clone, Debug, Default)]
pub struct ZenohWays {
    /// Address at which the daemon listens.
    pub listen: Vec<String>,
    /// Routers that it joins.
    pub routers: Vec<String>,
}

impl ZenohWays {
    /// The first of each, without settings, which may name files.
    pub(super) fn for_everyone(&self) -> Self {
        let bare = |locator: &String| locator.split(['#', '?']).next().unwrap_or_default().to_owned();
        let first = |locators: &[String]| locators.iter().map(bare).take(MAX_LOCATORS).collect();
        Self { listen: first(&self.listen), routers: first(&self.routers) }
    }
}

/// `GET /.well-known/simd.json`.
pub(super) async fn ways(State(page): State<Arc<Page>>) -> Response<Body> {
    let info = page.handle.info();
    let ZenohWays { listen, routers } = &page.zenoh;
    let document = Ways { name: &info.name, version: info.version, zenoh: listen, routers };
    let text = serde_json::to_string(&document).unwrap_or_default();
    ([(header::CONTENT_TYPE, HeaderValue::from_static("application/json"))], text).into_response()
}
