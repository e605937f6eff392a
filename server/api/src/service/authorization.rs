//! Passes calls whose token allows them. Calls that change something are logged and are events: token,
//! client, transport, method, robots, and outcome.

use std::convert::Infallible;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};

use http_body::{Frame, SizeHint};
use simd_proto::access::{Role, TOKEN_HEADER, parse_bearer, parse_cookie};
use simd_proto::v1::ErrorReason;
use simd_proto::{CLIENT_HEADER, methods};
use tokio::time::Sleep;
use tokio_util::sync::WaitForCancellationFutureOwned;
use tonic::body::Body;
use tonic::codegen::http::{HeaderMap, Request, Response, header};
use tonic::codegen::{Bytes, Service};
use tonic::server::NamedService;
use tonic::{Code, Status};

use super::counted::reason;
use super::limited::account;
use super::status::Explained;
use super::watched::watched;
use simd_world::SimHandle;
use simd_world::access::{Denied, Grant, concern_of, role_of};
use simd_world::handle::{AuditedCall, Peer, RobotNote, Transport};

/// Methods that clients call many times a second: their calls are not logged.
const FREQUENT: [&str; 12] = [
    "/simd.v1.JointService/SetJointTargets",
    "/simd.v1.JointService/Control",
    "/simd.v1.EntityService/ApplyLinkWrench",
    "/simd.v1.EntityService/PullLink",
    "/simd.v1.ParameterService/SetParameters",
    "/simd.v1.SimulationService/StepSimulation",
    "/simd.v1.ViewService/AddMarkers",
    "/simd.v1.ViewService/DeleteMarkers",
    "/simd.v1.ViewService/ReportView",
    "/simd.v1.ViewService/SetCamera",
    "/simd.v1.ViewService/SetLinkColors",
    "/simd.v1.ViewService/NextInput",
];

/// A service that only calls with sufficient rights reach.
#[derive(Clone, Debug)]
pub struct Authorized<S> {
    /// Wrapped service.
    pub service: S,
    /// World with the tokens, which also gets calls as events.
    pub handle: SimHandle,
    /// Transport of calls whose extensions name none.
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
        // A caller within the process has full access anyway.
        if !self.handle.access().is_required() || transport == Transport::Handle {
            return Answer::Passed { answer: self.service.call(request), grant: None, line: None };
        }
        let path = request.uri().path().to_owned();
        let (service, method) = methods::parse_path(&path).unwrap_or_default();
        let needed = role_of(service, method);
        let said = |token: &str| {
            Line(Some(Call {
                handle: self.handle.clone(),
                note: RobotNote::default(),
                call: AuditedCall {
                    token: token.to_owned(),
                    client: client(request.headers()),
                    peer: request.extensions().get::<Peer>().map(ToString::to_string).unwrap_or_default(),
                    transport: transport.name(),
                    method: path.strip_prefix("/simd.v1.").unwrap_or(&path).to_owned(),
                    ..AuditedCall::default()
                },
            }))
        };
        let granted = self.handle.access().check(token(request.headers()), needed, method);
        let granted = granted.and_then(|grant| {
            let concern = concern_of(service, method);
            grant.as_ref().map_or(Ok(()), |grant| grant.check_concern(concern)).map(|()| grant)
        });
        match granted {
            Ok(grant) => {
                let is_noted = needed > Role::Viewer && !FREQUENT.contains(&path.as_str());
                let line = grant.as_ref().filter(|_| is_noted).map(|grant| said(&grant.name));
                let is_stream = methods::find(service, method).is_some_and(|method| method.gives_many);
                if let Some(grant) = &grant {
                    request.extensions_mut().insert(Arc::clone(grant));
                }
                if let Some(Line(Some(call))) = &line {
                    request.extensions_mut().insert(call.note.clone());
                }
                let answer = self.service.call(request);
                Answer::Passed { answer, grant: grant.filter(|_| is_stream), line }
            }
            Err(denied) => {
                let status = Status::from(refusal(&denied));
                if let Some(unlogged) = self.handle.access().may_log_refusal() {
                    said(denied.name()).write_refusal(&denied, &status, unlogged);
                }
                let wait = self.handle.access().wait_before(&denied, &account(&request, transport));
                let wait = (!wait.is_zero()).then(|| Box::pin(tokio::time::sleep(wait)));
                Answer::Denied { wait, refusal: Some(status.into_http()) }
            }
        }
    }
}

/// Refuses a take-over that the caller's token does not allow.
pub(super) fn may_take_over<M>(
    request: &tonic::Request<M>,
    takes_over: bool,
    method: &str,
) -> Result<(), Status> {
    let Some(grant) = request.extensions().get::<Arc<Grant>>().filter(|_| takes_over) else { return Ok(()) };
    let allowed = grant.check(Role::Admin, &format!("{method} with take_over"));
    allowed.map_err(|denied| Status::from(refusal(&denied)))
}

/// Returns the refusal of a denied call.
pub fn refusal(denied: &Denied) -> Explained {
    let reason = match denied {
        Denied::Missing | Denied::Unknown | Denied::Expired { .. } => ErrorReason::Unauthenticated,
        Denied::Role { .. } => ErrorReason::RoleTooLow,
        Denied::Robots { .. } => ErrorReason::RobotNotAllowed,
    };
    Explained::new(reason, denied)
}

/// Returns the token of a request: in its header, or in the cookie of the page.
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

/// Line of the log for a call, written when it ends. A call whose client disconnects leaves a line too.
#[derive(Debug)]
pub struct Line(Option<Call>);

/// Facts about a call.
#[derive(Debug)]
struct Call {
    handle: SimHandle,
    note: RobotNote,
    call: AuditedCall,
}

impl Drop for Line {
    fn drop(&mut self) {
        self.write(&Status::cancelled("its caller disconnected before the end"));
    }
}

impl Line {
    /// Writes the line of a passed call, once.
    fn write(&mut self, status: &Status) {
        let Some(Call { handle, note, call }) = self.0.take() else { return };
        let result = match status.code() {
            Code::Ok => "ok".to_owned(),
            code => format!("{code:?}: {}", status.message()),
        };
        let call = AuditedCall { robots: note.robots(), code: status.code().into(), ..call };
        let call = AuditedCall { reason: reason(status), ..call };
        let AuditedCall { token, client, peer, transport, method, .. } = &call;
        let robot = call.robots.join(",");
        tracing::info!(target: "simd::audit", token, client, peer, transport, method, robot, result, "call");
        handle.audited(call);
    }

    /// Writes the line of a refused call, with the number of unlogged refusals before it. It is an event only
    /// if its token is known: unknown clients must not be able to push events out.
    fn write_refusal(mut self, denied: &Denied, status: &Status, unlogged: u64) {
        let Some(Call { handle, note: _, call }) = self.0.take() else { return };
        let call = AuditedCall { code: status.code().into(), reason: reason(status), ..call };
        let AuditedCall { token, client, peer, transport, method, .. } = &call;
        tracing::info!(
            target: "simd::audit", token, client, peer, transport, method, robot = "", result = %denied, unlogged, "refused"
        );
        if matches!(denied, Denied::Role { .. }) {
            handle.audited(call);
        }
    }
}

/// Answer of an [`Authorized`] service.
#[derive(Debug)]
pub enum Answer<F> {
    /// The service answers.
    Passed {
        /// Pending answer.
        answer: F,
        /// Rights of a stream, which ends when its token is revoked.
        grant: Option<Arc<Grant>>,
        /// Line to write when the call ends.
        line: Option<Line>,
    },
    /// A refusal.
    Denied {
        /// Wait before the refusal is sent.
        wait: Option<Pin<Box<Sleep>>>,
        /// The refusal; `None` once it is sent.
        refusal: Option<Response<Body>>,
    },
}

impl<F> Future for Answer<F>
where
    F: Future<Output = Result<Response<Body>, Infallible>> + Unpin,
{
    type Output = F::Output;

    fn poll(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        match &mut *self {
            Self::Denied { wait, refusal } => {
                if let Some(wait) = wait {
                    ready!(wait.as_mut().poll(context));
                }
                match refusal.take() {
                    Some(refusal) => Poll::Ready(Ok(refusal)),
                    None => Poll::Pending,
                }
            }
            Self::Passed { answer, grant, line } => Pin::new(answer).poll(context).map_ok(|response| {
                // Only a refusal has its status in the headers; a stream has its status at its end.
                let refused = Status::from_header_map(response.headers());
                let response = match (line.take(), refused, &grant) {
                    (Some(mut line), None, Some(_)) => watched(response, move |status| line.write(status)),
                    (Some(mut line), refused, _) => {
                        line.write(&refused.unwrap_or_else(|| Status::ok("")));
                        response
                    }
                    (None, ..) => response,
                };
                match grant.take() {
                    Some(grant) => response.map(|body| Body::new(Revocable::new(body, &grant))),
                    None => response,
                }
            }),
        }
    }
}

/// Body of a stream, which ends when its client's token is revoked or expires.
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
