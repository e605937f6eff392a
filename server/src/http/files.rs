//! Meshes and colliders as glTF, and uploaded files unchanged, each by its hash.

use std::sync::Arc;

use axum::Extension;
use axum::body::Body;
use axum::extract::{Path, Request, State};
use axum::http::header::{self, HeaderValue};
use axum::http::{HeaderMap, Response, StatusCode};
use axum::response::IntoResponse;
use bytes::Bytes;
use simd_model::robot::Sha256;

use super::login;
use super::{Page, caching, refused};
use simd_world::SimHandle;
use simd_world::handle::{CallContext, MeshKey};

/// Policy for untrusted files: a browser shows one, if at all, as a document without any rights.
pub(super) const SANDBOX: &str = "default-src 'none'; sandbox; frame-ancestors 'none'";

/// `GET /meshes/SHA256.glb`: a mesh that a robot uses, as binary glTF.
pub(super) async fn mesh(
    State(page): State<Arc<Page>>,
    Path(name): Path<String>,
    Extension(call): Extension<CallContext>,
    asked: HeaderMap,
) -> Response<Body> {
    let missing = ["the address of a mesh is /meshes/SHA256.glb", "no robot uses a mesh of this hash"];
    gltf_of(&page.handle.of_call(call), &name, MeshKey::Mesh, missing, &asked).await
}

/// `GET /colliders/SHA256.glb`: a convex collider of a robot, as binary glTF.
pub(super) async fn collider(
    State(page): State<Arc<Page>>,
    Path(name): Path<String>,
    Extension(call): Extension<CallContext>,
    asked: HeaderMap,
) -> Response<Body> {
    let missing =
        ["the address of a collider is /colliders/SHA256.glb", "no robot has a convex collider of this hash"];
    gltf_of(&page.handle.of_call(call), &name, MeshKey::Collider, missing, &asked).await
}

/// Returns the glTF of a file name. `missing` is the answer if the name is not a hash, or there is no such
/// glTF.
async fn gltf_of(
    handle: &SimHandle,
    name: &str,
    key: fn(Sha256) -> MeshKey,
    missing: [&'static str; 2],
    asked: &HeaderMap,
) -> Response<Body> {
    let [no_hash, unknown] = missing;
    let Some(sha256) = hash_of(name) else { return not_found(no_hash) };
    gltf(handle, key(sha256), sha256, asked).await.unwrap_or_else(|| not_found(unknown))
}

fn hash_of(name: &str) -> Option<Sha256> {
    name.strip_suffix(".glb").and_then(Sha256::parse)
}

/// Returns a glTF; `None` if there is no such mesh.
async fn gltf(handle: &SimHandle, key: MeshKey, sha256: Sha256, asked: &HeaderMap) -> Option<Response<Body>> {
    let tag = caching::tag(&format!("{sha256}glb"));
    if caching::has(asked, &tag) {
        return Some(unchanged(tag));
    }
    match handle.meshes().get(handle, key).await {
        Ok(glb) => glb.map(|glb| {
            let gzip = glb.gzip.filter(|_| caching::takes_gzip(asked));
            let encoding = gzip.is_some().then_some("gzip");
            lasting(gzip.unwrap_or(glb.bytes), "model/gltf-binary", encoding, tag)
        }),
        Err(error) => Some(refused(&error)),
    }
}

/// `GET /assets/SHA256.EXTENSION`: an unchanged file of a robot, otherwise a file of the page.
pub(super) async fn asset(
    State(page): State<Arc<Page>>,
    Path(name): Path<String>,
    request: Request,
) -> Response<Body> {
    let asked = request.headers();
    let (hash, extension) = name.split_once('.').unwrap_or((&name, ""));
    let Some(sha256) = Sha256::parse(hash) else {
        let file = page.bundle.answer(&format!("assets/{name}"), asked);
        return file.unwrap_or_else(|| not_found("there is no such file"));
    };
    // The page's own files are public, but robots' files are not.
    if let Err(refusal) = login::admit(&page.handle, &request) {
        return refusal.said().await;
    }
    let tag = caching::tag(&sha256.to_string());
    if caching::has(asked, &tag) {
        return unchanged(tag);
    }
    match page.handle.asset(&sha256) {
        Some(bytes) => {
            let mut response = lasting(bytes, media_type(extension), None, tag);
            let sandbox = HeaderValue::from_static(SANDBOX);
            response.headers_mut().insert(header::CONTENT_SECURITY_POLICY, sandbox);
            response
        }
        None => not_found("no file of this hash is kept"),
    }
}

/// Returns the media type of a robot's file, never one that a browser would run.
fn media_type(extension: &str) -> &'static str {
    match extension.to_ascii_lowercase().as_str() {
        "stl" => "model/stl",
        "obj" => "model/obj",
        "dae" => "model/vnd.collada+xml",
        "png" => "image/png",
        "jpg" | "jpeg" => "image/jpeg",
        _ => "application/octet-stream",
    }
}

fn lasting(
    bytes: Bytes,
    media_type: &'static str,
    encoding: Option<&'static str>,
    tag: HeaderValue,
) -> Response<Body> {
    let mut response = unchanged(tag);
    *response.status_mut() = StatusCode::OK;
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(media_type));
    if let Some(encoding) = encoding {
        headers.insert(header::CONTENT_ENCODING, HeaderValue::from_static(encoding));
    }
    *response.body_mut() = Body::from(bytes);
    response
}

fn unchanged(tag: HeaderValue) -> Response<Body> {
    let mut response = Response::new(Body::empty());
    *response.status_mut() = StatusCode::NOT_MODIFIED;
    let headers = response.headers_mut();
    headers.insert(header::ETAG, tag);
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static(caching::IMMUTABLE));
    headers.insert(header::VARY, HeaderValue::from_static("accept-encoding"));
    response
}

fn not_found(sentence: &'static str) -> Response<Body> {
    (StatusCode::NOT_FOUND, format!("{sentence}\n")).into_response()
}
