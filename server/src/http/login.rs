//! The token of the page, in a cookie that its scripts cannot read, for as long as the browser runs. Requests
//! of the page, with or without a token, count for a client like calls.

use std::sync::Arc;
use std::time::Duration;

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
use simd_world::handle::{CallContext, Peer};

/// Admits a request, which only reads, and counts it for its client.
pub(super) async fn check(
    State(handle): State<SimHandle>,
    mut request: Request,
    next: Next,
) -> Response<Body> {
    match admit(&handle, &request) {
        Ok(call) => {
            request.extensions_mut().insert(call);
            next.run(request).await
        }
        Err(refusal) => refusal.said().await,
    }
}

/// A refusal, and how long it has to wait.
pub(super) struct Refusal {
    wait: Duration,
    response: Response<Body>,
}

impl Refusal {
    /// The refusal, once it may be said.
    pub(super) async fn said(self) -> Response<Body> {
        tokio::time::sleep(self.wait).await;
        self.response
    }

    fn of(access: &Access, denied: &Denied, request: &Request) -> Self {
        log(access, denied);
        Self { wait: access.wait_before(denied, &sender(request)), response: refused(denied) }
    }
}

/// Returns the client of a request without a token. Every network brings a request with its peer.
fn sender(request: &Request) -> Account {
    request.extensions().get::<Peer>().map_or(Account::Unknown, Account::from)
}

/// Returns the context of a request, if its token allows reading and its client has not used its share;
/// otherwise the refusal.
pub(super) fn admit(handle: &SimHandle, request: &Request) -> Result<CallContext, Refusal> {
    let access = handle.access();
    let grant = access.check(token(request.headers()), Role::Viewer, "the page");
    let grant = grant.map_err(|denied| Refusal::of(access, &denied, request))?;
    let account = match grant {
        Some(grant) => Account::Token(grant.name.as_str().into()),
        None => sender(request),
    };
    let over = |error| Refusal { wait: Duration::ZERO, response: super::refused(&error) };
    let call = CallContext::of(account);
    handle.of_call(call.clone()).count_call().map_err(over)?;
    Ok(call)
}

/// `POST /login` with `authorization: Bearer TOKEN`: 204 and the cookie, or 401.
pub(super) async fn log_in(State(page): State<Arc<Page>>, request: Request) -> Response<Body> {
    let said = request.headers().get(TOKEN_HEADER).and_then(|said| said.to_str().ok());
    let said = said.and_then(simd_proto::access::parse_bearer);
    match page.handle.access().check(said, Role::Viewer, "the page") {
        Ok(_grant) => with_cookie(&format!("{TOKEN_COOKIE}={}", said.unwrap_or_default()), page.is_tls),
        Err(denied) => Refusal::of(page.handle.access(), &denied, &request).said().await,
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
