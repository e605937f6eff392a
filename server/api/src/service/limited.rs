//! Holds each client to its share, and says for whom a call works.

pub use std::convert::Infallible;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};

use simd_proto::{CLIENT_HEADER, methods};
use tonic::Status;
use tonic::body::Body;
use tonic::codegen::Service;
use tonic::codegen::http::{Request, Response};
use tonic::server::NamedService;

use super::held::Held;
use super::status::Explained;
use simd_world::SimHandle;
use simd_world::access::Grant;
use simd_world::account::Account;
use simd_world::handle::{Caller, Peer, Transport};

/// A service whose clients have shares.
#[derive(Clone, Debug)]
pub struct Limited<S> {
    /// What is called.
    pub service: S,
    /// Where shares are counted.
    pub handle: SimHandle,
    /// How calls come where their extensions do not say otherwise.
    pub transport: Transport,
}

impl<S: NamedService> NamedService for Limited<S> {
    const NAME: &'static str = S::NAME;
}

impl<S> Service<Request<Body>> for Limited<S>
where
    S: Service<Request<Body>, Response = Response<Body>, Error = Infallible>,
    S::Future: Send + 'static,
{
    type Response = Response<Body>;
    type Error = Infallible;
    type Future = Pin<Box<dyn Future<Output = Result<Response<Body>, Infallible>> + Send>>;

    fn poll_ready(&mut self, context: &mut Context<'_>) -> Poll<Result<(), Infallible>> {
        self.service.poll_ready(context)
    }

    fn call(&mut self, mut request: Request<Body>) -> Self::Future {
        let account = account(&request, self.transport);
        request.extensions_mut().insert(account.clone());
        let path = request.uri().path();
        let method = methods::parse_path(path).and_then(|(service, method)| methods::find(service, method));
        let is_stream = method.is_some_and(|method| method.gives_many);
        let counted = self.handle.count_call(&account);
        let stream = counted.and_then(|()| match is_stream {
            true => self.handle.count_stream(&account),
            false => Ok(None),
        });
        let stream = match stream {
            Ok(stream) => stream,
            Err(refused) => {
                return Box::pin(std::future::ready(Ok(Status::from(Explained::from(&refused)).into_http())));
            }
        };
        let answer = account.scope(self.service.call(request));
        Box::pin(async move {
            Ok(match (answer.await?, stream) {
                (response, Some(stream)) => response.map(|body| Body::new(Held::new(body, stream))),
                (response, None) => response,
            })
        })
    }
}

/// Whose call it is: that of a token, whatever way it comes; else of the way. Over Zenoh, where a session need not say which
/// it is, those of one name have one share, and those of none have one too.
fn account(request: &Request<Body>, transport: Transport) -> Account {
    let extensions = request.extensions();
    if let Some(grant) = extensions.get::<Arc<Grant>>() {
        return Account::Token(grant.name.as_str().into());
    }
    match extensions.get::<Peer>() {
        Some(Peer::Connection { number, address }) => Account::of_connection(*number, *address),
        Some(Peer::Session(id)) => Account::Session(Arc::clone(id)),
        Some(Peer::Process) => Account::Process,
        None => match extensions.get().copied().unwrap_or(transport) {
            Transport::Handle => Account::Process,
            transport => {
                let said = request.headers().get(CLIENT_HEADER).and_then(|said| said.to_str().ok());
                let caller = said.and_then(|said| Caller::said(said, transport));
                Account::Session(caller.map_or_else(|| "without a name".into(), |caller| caller.name))
            }
        },
    }
}
