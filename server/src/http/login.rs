//! The token of the page, in a cookie that its scripts cannot read, for as long as the browser runs. Requests
//! of the page, with or without a token, count for a client like calls.

use std::sync::Arc;

use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::{HeaderValue, Response, StatusCode, header};
use axum::middleware::Next;
use axum::response::IntoResponse as _;
use simd_proto::access::{Role, TOKEN_COOKIE, TOKEN_HEADER};

use super::Page;
use simd_api::service::authorization::token;
use simd_world::SimHandle;
use simd_world::access::{Access, Denied};
use simd_world::account::Account;
use simd_world::handle::Peer;

/// Admits a request, which only reads, and counts it for its client.
pub(super) async fn check(State(handle): State<SimHandle>, request: Request, next: Next) -> Response<Body> {
    match admit(&handle, &request) {
        Ok(account) => account.scope(next.run(request)).await,
        Err(refusal) => refusal,
    }
}

/// Returns the client that a request counts for if its token allows reading and the client has not used its
/// share; otherwise the refusal.
pub(super) fn admit(handle: &SimHandle, request: &Request) -> Result<Account, Response<Body>> {
    let access = handle.access();
    let grant = access.check(token(request.headers()), Role::Viewer, "the page").map_err(|denied| {
        log(access, &denied);
        refused(&denied)
    })?;
    let account = match (grant, request.extensions().get::<Peer>()) {
        (Some(grant), _) => Account::Token(grant.name.as_str().into()),
        (None, Some(Peer::Connection { number, address })) => Account::of_connection(*number, *address),
        (None, Some(Peer::Session(id))) => Account::Session(Arc::clone(id)),
        // A request without a peer does not come from a network.
        (None, Some(Peer::Process) | None) => Account::Process,
    };
    handle.count_call(&account).map_err(|error| super::refused(&error))?;
    Ok(account)
}

/// `POST /login` with `authorization: Bearer TOKEN`: 204 and the cookie, or 401.
pub(super) async fn log_in(State(page): State<Arc<Page>>, request: Request) -> Response<Body> {
    let said = request.headers().get(TOKEN_HEADER).and_then(|said| said.to_str().ok());
    let said = said.and_then(simd_proto::access::parse_bearer);
    match page.handle.access().check(said, Role::Viewer, "the page") {
        Ok(_grant) => with_cookie(&format!("{TOKEN_COOKIE}={}", said.unwrap_or_default()), page.is_tls),
        Err(denied) => {
            log(page.handle.access(), &denied);
            refused(&denied)
        }
    }
}

fn log(access: &Access, denied: &Denied) {
    if let Some(unlogged) = access.may_log_refusal() {
        tracing::info!(target: "simd::audit", token = denied.name(), transport = "http", result = %denied, unlogged, "refused");
    }
}

/// `DELETE /login`: the browser forgets the token.
pub(super) async fn log_out(State(page): State<Arc<Page>>) -> Response<Body> {
    with_cookie(&format!("{TOKEN_COOKIE}=; Max-Age=0"), page.is_tls)
}

/// Sets a cookie that scripts cannot read, other sites' pages cannot send, and, if the daemon speaks TLS, is
/// only sent over TLS. Without TLS (`--insecure`), a browser would not keep a `Secure` one.
fn with_cookie(cookie: &str, is_tls: bool) -> Response<Body> {
    let secure = if is_tls { "; Secure" } else { "" };
    let cookie = HeaderValue::try_from(format!("{cookie}; Path=/; HttpOnly; SameSite=Strict{secure}"));
    match cookie {
        Ok(cookie) => (StatusCode::NO_CONTENT, [(header::SET_COOKIE, cookie)]).into_response(),
        Err(_) => StatusCode::INTERNAL_SERVER_ERROR.into_response(),
    }
}

fn refused(denied: &Denied) -> Response<Body> {
    let status = match denied {
        Denied::Missing | Denied::Unknown | Denied::Expired { .. } => StatusCode::UNAUTHORIZED,
        Denied::Role { .. } | Denied::Robots { .. } => StatusCode::FORBIDDEN,
    };
    (status, format!("{denied}\n")).into_response()
}
