//! Requests that are executed once, however often they arrive: the only place that reads a `request_id`.
//!
//! The type and the bytes of a request give its kind and digest, and its extensions give its caller. So no
//! method can forget one of them.

use crate::service::status::OrStatus as _;
use std::future::Future;

use bytes::Bytes;
use prost::Message as _;
use simd_core::Error;
use simd_model::robot::Sha256;
use simd_proto::checked::{Identified, Known};
use tonic::{Request, Response, Status};
use tonic_types::pb;

use super::calls::context;
use super::claims::Presented;
use super::status::Explained;
use crate::convert::BadField;
use simd_world::SimHandle;
use simd_world::handle::{CallContext, CallError, IdentifiedRequest, Outcome, Peer, Scope};

/// Cause of a refusal: a field, or the execution.
#[derive(Debug)]
pub(super) enum Refused {
    Field(BadField),
    Call(CallError),
}

impl From<BadField> for Refused {
    fn from(error: BadField) -> Self {
        Self::Field(error)
    }
}

impl From<CallError> for Refused {
    fn from(error: CallError) -> Self {
        Self::Call(error)
    }
}

impl From<Error> for Refused {
    fn from(error: Error) -> Self {
        Self::Call(error.into())
    }
}

impl From<&Refused> for Explained {
    fn from(refused: &Refused) -> Self {
        match refused {
            Refused::Field(error) => error.into(),
            Refused::Call(error) => error.into(),
        }
    }
}

impl From<Refused> for Status {
    fn from(refused: Refused) -> Self {
        Explained::from(&refused).into()
    }
}

/// Answers a request by `work`, or repeats the answer to the same request. Work for a request with an id runs
/// to its end, even if its caller disconnects. Its handle acts for the claim that the request names. A
/// refused claim is not stored as the answer, since another caller may have made the request.
pub(super) async fn once<M, A, W>(
    handle: &SimHandle,
    request: Request<M>,
    work: impl FnOnce(SimHandle, M) -> W,
) -> Result<Response<A>, Status>
where
    M: Identified,
    A: Known,
    W: Future<Output = Result<A, Refused>> + Send + 'static,
{
    answer(handle, request, false, work).await
}

/// Like `once`, for answers private to one caller, even if another caller gives the same name.
pub(super) async fn once_in_secret<M, A, W>(
    handle: &SimHandle,
    request: Request<M>,
    work: impl FnOnce(SimHandle, M) -> W,
) -> Result<Response<A>, Status>
where
    M: Identified,
    A: Known,
    W: Future<Output = Result<A, Refused>> + Send + 'static,
{
    answer(handle, request, true, work).await
}

async fn answer<M, A, W>(
    handle: &SimHandle,
    request: Request<M>,
    is_secret: bool,
    work: impl FnOnce(SimHandle, M) -> W,
) -> Result<Response<A>, Status>
where
    M: Identified,
    A: Known,
    W: Future<Output = Result<A, Refused>> + Send + 'static,
{
    let call = context(request.extensions());
    let identified = identified(&request, &call, is_secret).or_status()?;
    let claim = Presented::of(request.extensions()).claim(handle, request.get_ref().claim());
    // Renewed here and not only by its commands: a retry that is answered from memory renews it too.
    if let Ok(Some(claim)) = &claim {
        handle.renew(*claim);
    }
    let handle_of = |claim| handle.of_call(CallContext { claim, ..call });
    let work = claim.map(|claim| work(handle_of(claim), request.into_inner()));
    let Some(identified) = identified else { return Ok(Response::new(work.or_status()?.await?)) };
    let outcome =
        handle.once(identified, work.map(|work| async { outcome(work.await) })).await.or_status()?;
    let broken = || CallError::Internal { message: "a remembered answer cannot be read".into() };
    match outcome.bytes {
        Ok(bytes) => Ok(Response::new(A::decode(bytes).map_err(|_| broken()).or_status()?)),
        Err(bytes) => {
            let status = pb::Status::decode(bytes.clone()).map_err(|_| broken()).or_status()?;
            Err(Status::with_details(status.code.into(), status.message, bytes))
        }
    }
}

/// Returns the identity of a request; `None` if it has no id.
fn identified<M: Identified>(
    request: &Request<M>,
    call: &CallContext,
    is_secret: bool,
) -> Result<Option<IdentifiedRequest>, CallError> {
    let message = request.get_ref();
    let id = message.request_id();
    if id.is_empty() {
        return Ok(None);
    }
    Ok(Some(IdentifiedRequest {
        scope: scope(call)?,
        kind: M::NAME,
        id: id.to_owned(),
        // Equal messages have equal bytes: maps are ordered.
        digest: Sha256::of(&message.encode_to_vec()),
        peer: call.peer.clone().filter(Peer::is_certain),
        is_secret,
    }))
}

fn scope(call: &CallContext) -> Result<Scope, CallError> {
    match (&call.caller, &call.peer) {
        (Some(caller), _) => Ok(Scope::Named(caller.clone())),
        (None, Some(peer)) => Ok(Scope::Unnamed(peer.clone())),
        (None, None) => Err(CallError::InvalidValue {
            element: "request_id".into(),
            value: "from an unknown caller".into(),
            expected: "over Zenoh it needs a client's name in the attachment, or the query's source info"
                .into(),
        }),
    }
}

fn outcome<A: Known>(done: Result<A, Refused>) -> Outcome {
    match done {
        Ok(answer) => Outcome { bytes: Ok(answer.encode_to_vec().into()), is_transient: false },
        Err(refused) => {
            let is_transient = matches!(&refused, Refused::Call(error) if error.is_transient());
            // The details contain the whole refusal, with code and sentence.
            let status = Status::from(refused);
            Outcome { bytes: Err(Bytes::copy_from_slice(status.details())), is_transient }
        }
    }
}
