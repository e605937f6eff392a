//! Records callers: services find a [`Caller`] in a request's extensions, and the daemon knows its clients.

use std::convert::Infallible;
use std::pin::Pin;
use std::task::{Context, Poll};

use simd_proto::CLIENT_HEADER;
use tonic::body::Body;
use tonic::codegen::Service;
use tonic::codegen::http::{Request, Response};
use tonic::server::NamedService;

use super::held::Held;
use simd_world::SimHandle;
use simd_world::handle::{Caller, Peer, Transport, UnderWay};

/// A service whose callers are recorded.
#[derive(Clone, Debug)]
pub struct RecordCaller<S> {
    /// Wrapped service.
    pub service: S,
    /// World that records callers.
    pub handle: SimHandle,
    /// Transport of calls whose extensions name none.
    pub transport: Transport,
}

impl<S: NamedService> NamedService for RecordCaller<S> {
    const NAME: &'static str = S::NAME;
}

impl<S> Service<Request<Body>> for RecordCaller<S>
where
    S: Service<Request<Body>, Response = Response<Body>, Error = Infallible>,
    S::Future: Unpin,
{
    type Response = Response<Body>;
    type Error = Infallible;
    type Future = Answer<S::Future>;

    fn poll_ready(&mut self, context: &mut Context<'_>) -> Poll<Result<(), Infallible>> {
        self.service.poll_ready(context)
    }

    fn call(&mut self, mut request: Request<Body>) -> Self::Future {
        let transport = request.extensions().get().copied().unwrap_or(self.transport);
        if transport == Transport::Handle {
            request.extensions_mut().insert(Peer::Process);
        }
        request.extensions_mut().insert(transport);
        let said = request.headers().get(CLIENT_HEADER).and_then(|said| said.to_str().ok());
        let call = said.and_then(|said| Caller::said(said, transport)).map(|caller| {
            request.extensions_mut().insert(caller.clone());
            self.handle.begin_call(caller)
        });
        Answer { answer: self.service.call(request), call }
    }
}

/// Answer of a [`RecordCaller`] service.
#[derive(Debug)]
pub struct Answer<F> {
    answer: F,
    call: Option<UnderWay>,
}

impl<F> Future for Answer<F>
where
    F: Future<Output = Result<Response<Body>, Infallible>> + Unpin,
{
    type Output = F::Output;

    fn poll(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        Pin::new(&mut self.answer).poll(context).map_ok(|response| match self.call.take() {
            Some(call) => response.map(|body| Body::new(Held::new(body, call))),
            None => response,
        })
    }
}
