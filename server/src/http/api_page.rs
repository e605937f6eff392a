//! `/openapi.json`, and `/api/`: a page to try the methods in. Everyone may read both; the calls need a token as all do.

use axum::body::Body;
use axum::http::{HeaderValue, Response, header};
use axum::response::{IntoResponse as _, Redirect};

/// `GET /openapi.json`.
pub(super) async fn openapi() -> Response<Body> {
    file("application/json", crate::connect::document())
}

/// `GET /api`.
pub(super) async fn moved() -> Redirect {
    Redirect::permanent("/api/")
}

/// `GET /api/`.
pub(super) async fn page() -> Response<Body> {
    file("text/html; charset=utf-8", include_bytes!("api_page/index.html").as_slice())
}

/// `GET /api/api.js`.
pub(super) async fn script() -> Response<Body> {
    file("text/javascript; charset=utf-8", include_bytes!("api_page/api.js").as_slice())
}

/// `GET /api/api.css`.
pub(super) async fn style() -> Response<Body> {
    file("text/css; charset=utf-8", include_bytes!("api_page/api.css").as_slice())
}

fn file(media: &'static str, bytes: impl Into<Body>) -> Response<Body> {
    ([(header::CONTENT_TYPE, HeaderValue::from_static(media))], bytes.into()).into_response()
}
