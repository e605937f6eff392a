//! Each call passes here before its service, on every transport. It is counted; then its client's version, its
//! token, and its client's share are checked. Its context goes to the service in the request's extensions.

use std::sync::Arc;

use axum::extract::{Request, State};
use axum::middleware::Next;
use axum::response::Response;
use simd_proto::{CLIENT_HEADER, methods};
use tonic::Extensions;
use tonic::body::Body;

use super::held::Held;
use super::{authorization, counted, limited, transport, version};
use simd_world::SimHandle;
use simd_world::account::Account;
use simd_world::handle::{CallContext, Caller, Peer, Transport};

/// World of the services, and the transport of calls whose extensions name none.
#[derive(Clone, Debug)]
pub(super) struct Entrance {
    pub(super) handle: SimHandle,
    pub(super) transport: Transport,
}

/// Passes a call to its service, or refuses it.
pub(super) async fn pass(State(entrance): State<Entrance>, request: Request, next: Next) -> Response {
    let Entrance { handle, transport } = entrance;
    let transport = request.extensions().get().copied().unwrap_or(transport);
    let checked = |request| check(&handle, transport, request, next);
    counted::count(&handle, transport, request, checked).await.map(axum::body::Body::new)
}

/// Passes a call that nothing refuses.
async fn check(
    handle: &SimHandle,
    transport: Transport,
    mut request: Request,
    next: Next,
) -> tonic::codegen::http::Response<Body> {
    if let Err(status) = version::check_call(&request) {
        return status.into_http();
    }
    let mut call = of_request(&request, transport);
    let passed = match authorization::check(handle, &mut call, &request) {
        Ok(passed) => passed,
        Err(refused) => return refused.answer().await,
    };
    let method = methods::parse_path(request.uri().path());
    let method = method.and_then(|(service, method)| methods::find(service, method));
    let handle = handle.of_call(call.clone());
    let answer = match limited::admit(&handle, method) {
        Ok(admitted) => {
            let under_way = call.caller.clone().map(|caller| handle.begin_call(caller));
            request.extensions_mut().insert(call);
            let answer = async move {
                let answer = next.run(request).await.map(Body::new);
                match under_way {
                    Some(call) => answer.map(|body| Body::new(Held::new(body, call))),
                    None => answer,
                }
            };
            admitted.answer(&handle, answer).await
        }
        Err(refused) => refused.into_http(),
    };
    passed.end(transport::explained(answer))
}

/// Returns the context of a request, without the rights of its token. Its client is its connection. Zenoh
/// sessions need not identify themselves: sessions with the same name are one client, and so are sessions
/// without a name.
fn of_request(request: &Request, transport: Transport) -> CallContext {
    let said = request.headers().get(CLIENT_HEADER).and_then(|said| said.to_str().ok());
    let caller = said.and_then(|said| Caller::said(said, transport));
    let peer = match transport {
        Transport::Handle => Some(Peer::Process),
        _ => request.extensions().get().cloned(),
    };
    let account = match &peer {
        Some(peer) => Account::from(peer),
        None => {
            let name = caller.as_ref().map(|caller| Arc::clone(&caller.name));
            Account::Session(name.unwrap_or_else(|| "without a name".into()))
        }
    };
    CallContext { transport, peer, caller, ..CallContext::of(account) }
}

/// Returns the context of a call. A call without one counts for an unknown client.
pub(super) fn context(extensions: &Extensions) -> CallContext {
    extensions.get().cloned().unwrap_or_else(|| CallContext::of(Account::Unknown))
}

/// Returns a handle for a call.
pub(super) fn handle_of<M>(handle: &SimHandle, request: &tonic::Request<M>) -> SimHandle {
    handle.of_call(context(request.extensions()))
}

#[cfg(test)]
mod tests;
