//! Passes calls whose token allows them. Calls that change something are logged and are events: token,
//! client, transport, method, robots, and outcome.

use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use axum::extract::Request;
use http_body::{Frame, SizeHint};
use simd_proto::access::{Role, TOKEN_HEADER, parse_bearer, parse_cookie};
use simd_proto::v1::ErrorReason;
use simd_proto::{CLIENT_HEADER, methods};
use tokio_util::sync::WaitForCancellationFutureOwned;
use tonic::body::Body;
use tonic::codegen::Bytes;
use tonic::codegen::http::{HeaderMap, Response, header};
use tonic::{Code, Status};

use super::counted::reason;
use super::status::Explained;
use super::watched::watched;
use simd_world::SimHandle;
use simd_world::access::{Denied, Grant, concern_of, role_of};
use simd_world::account::Account;
use simd_world::handle::{AuditedCall, CallContext, RobotNote, Transport};

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

/// A call that its token allows, until its answer ends.
pub(super) struct Passed {
    /// Rights of a stream, which ends when its token is revoked.
    grant: Option<Arc<Grant>>,
    /// Line to write when the call ends.
    line: Option<Line>,
}

/// The refusal of a call, and how long it has to wait.
pub(super) struct Refused {
    wait: Duration,
    status: Status,
}

/// Checks the token of a call, and adds its rights to the context.
pub(super) fn check(
    handle: &SimHandle,
    call: &mut CallContext,
    request: &Request,
) -> Result<Passed, Refused> {
    // A caller within the process has full access anyway.
    if !handle.access().is_required() || call.transport == Transport::Handle {
        return Ok(Passed { grant: None, line: None });
    }
    let path = request.uri().path();
    let (service, method) = methods::parse_path(path).unwrap_or_default();
    let needed = role_of(service, method);
    let said = |token: &str| {
        Line(Some(Call {
            handle: handle.clone(),
            note: RobotNote::default(),
            call: AuditedCall {
                token: token.to_owned(),
                client: client(request.headers()),
                peer: call.peer.as_ref().map(ToString::to_string).unwrap_or_default(),
                transport: call.transport.name(),
                method: path.strip_prefix("/simd.v1.").unwrap_or(path).to_owned(),
                ..AuditedCall::default()
            },
        }))
    };
    let granted = handle.access().check(token(request.headers()), needed, method);
    let granted = granted.and_then(|grant| {
        let concern = concern_of(service, method);
        grant.as_ref().map_or(Ok(()), |grant| grant.check_concern(concern)).map(|()| grant)
    });
    let grant = match granted {
        Ok(Some(grant)) => grant,
        Ok(None) => return Ok(Passed { grant: None, line: None }),
        Err(denied) => {
            let status = Status::from(refusal(&denied));
            if let Some(unlogged) = handle.access().may_log_refusal() {
                said(denied.name()).write_refusal(&denied, &status, unlogged);
            }
            return Err(Refused { wait: handle.access().wait_before(&denied, &call.account), status });
        }
    };
    let is_noted = needed > Role::Viewer && !FREQUENT.contains(&path);
    let line = is_noted.then(|| said(&grant.name));
    if let Some(Line(Some(noted))) = &line {
        call.note = Some(noted.note.clone());
    }
    call.account = Account::Token(grant.name.as_str().into());
    call.grant = Some(Arc::clone(&grant));
    let is_stream = methods::find(service, method).is_some_and(|method| method.gives_many);
    Ok(Passed { grant: is_stream.then_some(grant), line })
}

impl Refused {
    /// Returns the refusal, once it may be said.
    pub(super) async fn answer(self) -> Response<Body> {
        if !self.wait.is_zero() {
            tokio::time::sleep(self.wait).await;
        }
        self.status.into_http()
    }
}

impl Passed {
    /// Returns the same answer, which ends with its token and is logged at its end.
    pub(super) fn end(self, answer: Response<Body>) -> Response<Body> {
        let Self { grant, line } = self;
        // Only a refusal has its status in the headers; a stream has its status at its end.
        let refused = Status::from_header_map(answer.headers());
        let answer = match (line, refused, &grant) {
            (Some(mut line), None, Some(_)) => watched(answer, move |status| line.write(status)),
            (Some(mut line), refused, _) => {
                line.write(&refused.unwrap_or_else(|| Status::ok("")));
                answer
            }
            (None, ..) => answer,
        };
        match grant {
            Some(grant) => answer.map(|body| Body::new(Revocable::new(body, &grant))),
            None => answer,
        }
    }
}

/// Refuses a take-over that the caller's token does not allow.
pub(super) fn may_take_over<M>(
    request: &tonic::Request<M>,
    takes_over: bool,
    method: &str,
) -> Result<(), Status> {
    let grant = request.extensions().get().and_then(|call: &CallContext| call.grant.as_ref());
    let Some(grant) = grant.filter(|_| takes_over) else { return Ok(()) };
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
struct Line(Option<Call>);

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
