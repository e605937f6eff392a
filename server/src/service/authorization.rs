//! Lets a call through whose token allows it. What is not only read is written into the log: whose token, from which
//! client, by which transport, which method, and how it ended.

use std::convert::Infallible;
use std::future::{Ready, ready};
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};

use http_body::{Frame, SizeHint};
use simd_proto::access::{Role, TOKEN_HEADER, parse_bearer, parse_cookie};
use simd_proto::v1::ErrorReason;
use simd_proto::{CLIENT_HEADER, methods};
use tokio_util::sync::WaitForCancellationFutureOwned;
use tonic::body::Body;
use tonic::codegen::http::{HeaderMap, Request, Response, header};
use tonic::codegen::{Bytes, Service};
use tonic::server::NamedService;
use tonic::{Code, Status};

use super::status::Explained;
use crate::access::{Access, Denied, Grant, role_of};
use crate::handle::{Peer, Transport};

/// Methods that clients call many times a second: each call is not worth a line.
const FREQUENT: [&str; 5] = [
    "/simd.v1.JointService/SetJointTargets",
    "/simd.v1.JointService/Control",
    "/simd.v1.EntityService/ApplyLinkWrench",
    "/simd.v1.ParameterService/SetParameters",
    "/simd.v1.SimulationService/StepSimulation",
];

/// A service that only those reach whose token allows it.
#[derive(Clone, Debug)]
pub struct Authorized<S> {
    /// What is called.
    pub service: S,
    /// Who may.
    pub access: Access,
    /// How calls come where their extensions do not say otherwise.
    pub transport: Transport,
}

impl<S: NamedService> NamedService for Authorized<S> {
    const NAME: &'static str = S::NAME;
}

impl<S> Service<Request<Body>> for Authorized<S>
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
        // Who is within the process has it anyway.
        if !self.access.is_required() || transport == Transport::Handle {
            return Answer::Passed { answer: self.service.call(request), grant: None, line: None };
        }
        let path = request.uri().path().to_owned();
        let (service, method) = methods::parse_path(&path).unwrap_or_default();
        let needed = role_of(service, method);
        let said = |grant: &str| Line {
            token: grant.to_owned(),
            client: client(request.headers()),
            peer: request.extensions().get::<Peer>().map(ToString::to_string).unwrap_or_default(),
            transport,
            path: path.clone(),
        };
        match self.access.check(token(request.headers()), needed, method) {
            Ok(grant) => {
                let is_noted = needed > Role::Viewer && !FREQUENT.contains(&path.as_str());
                let line = grant.as_ref().filter(|_| is_noted).map(|grant| said(&grant.name));
                let is_stream = methods::find(service, method).is_some_and(|method| method.gives_many);
                if let Some(grant) = &grant {
                    request.extensions_mut().insert(Arc::clone(grant));
                }
                let answer = self.service.call(request);
                Answer::Passed { answer, grant: grant.filter(|_| is_stream), line }
            }
            Err(denied) => {
                if let Some(unlogged) = self.access.may_log_refusal() {
                    said(denied.name()).write_refusal(&denied.to_string(), unlogged);
                }
                Answer::Denied(ready(Ok(Status::from(refusal(&denied)).into_http())))
            }
        }
    }
}

/// The refusal of a call.
pub fn refusal(denied: &Denied) -> Explained {
    let reason = match denied {
        Denied::Missing | Denied::Unknown | Denied::Expired { .. } => ErrorReason::Unauthenticated,
        Denied::Role { .. } => ErrorReason::RoleTooLow,
    };
    Explained::new(reason, denied)
}

/// The token of a request: in its header, or in the cookie of the page.
pub fn token(headers: &HeaderMap) -> Option<&str> {
    let text = |name| headers.get(name).and_then(|value| value.to_str().ok());
    if let Some(said) = text(TOKEN_HEADER) {
        return parse_bearer(said);
    }
    let cookies = headers.get_all(header::COOKIE).iter().filter_map(|value| value.to_str().ok());
    cookies.into_iter().find_map(parse_cookie)
}

fn client(headers: &HeaderMap) -> String {
    let said = headers.get(CLIENT_HEADER).and_then(|said| said.to_str().ok()).unwrap_or_default();
    said.chars().take(simd_proto::MAX_CLIENT_NAME).collect()
}

/// What is noted of a call.
#[derive(Debug)]
pub struct Line {
    token: String,
    client: String,
    peer: String,
    transport: Transport,
    path: String,
}

impl Line {
    fn write(&self, result: &str) {
        let Self { token, client, peer, transport, path } = self;
        let transport = transport.name();
        tracing::info!(target: "simd::audit", token, client, peer, transport, path, result, "call");
    }

    /// The same of a refusal, and how many before it had no line.
    fn write_refusal(&self, result: &str, unlogged: u64) {
        let Self { token, client, peer, transport, path } = self;
        let transport = transport.name();
        tracing::info!(target: "simd::audit", token, client, peer, transport, path, result, unlogged, "refused");
    }
}

/// The answer of an [`Authorized`] service.
#[derive(Debug)]
pub enum Answer<F> {
    /// That of the service.
    Passed {
        /// To come.
        answer: F,
        /// Of a stream, which ends where it is revoked.
        grant: Option<Arc<Grant>>,
        /// What is noted once it is there.
        line: Option<Line>,
    },
    /// A refusal.
    Denied(Ready<Result<Response<Body>, Infallible>>),
}

impl<F> Future for Answer<F>
where
    F: Future<Output = Result<Response<Body>, Infallible>> + Unpin,
{
    type Output = F::Output;

    fn poll(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        match &mut *self {
            Self::Denied(answer) => Pin::new(answer).poll(context),
            Self::Passed { answer, grant, line } => Pin::new(answer).poll(context).map_ok(|response| {
                if let Some(line) = line.take() {
                    // Only a refusal has its status in the headers.
                    let refused = Status::from_header_map(response.headers());
                    line.write(
                        &refused.map_or_else(|| Code::Ok.to_string(), |status| status.code().to_string()),
                    );
                }
                match grant.take() {
                    Some(grant) => response.map(|body| Body::new(Revocable::new(body, &grant))),
                    None => response,
                }
            }),
        }
    }
}

/// The body of a stream, which ends where its client's token is revoked or expires.
struct Revocable {
    body: Body,
    revoked: Pin<Box<WaitForCancellationFutureOwned>>,
    is_over: bool,
}

impl Revocable {
    fn new(body: Body, grant: &Grant) -> Self {
        Self { body, revoked: Box::pin(grant.revoked.clone().cancelled_owned()), is_over: false }
    }
}

impl http_body::Body for Revocable {
    type Data = Bytes;
    type Error = Status;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Status>>> {
        if self.is_over {
            return Poll::Ready(None);
        }
        if self.revoked.as_mut().poll(context).is_ready() {
            self.is_over = true;
            let status = Status::from(refusal(&Denied::Unknown));
            let mut trailers = HeaderMap::new();
            return Poll::Ready(Some(match status.add_header(&mut trailers) {
                Ok(()) => Ok(Frame::trailers(trailers)),
                Err(status) => Err(status),
            }));
        }
        Pin::new(&mut self.body).poll_frame(context)
    }

    fn is_end_stream(&self) -> bool {
        self.is_over || self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}
