//! Limits each client to its share, and sets the account of a call.

pub use std::convert::Infallible;
use std::future::ready;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};

use simd_proto::CLIENT_HEADER;
use simd_proto::methods::{self, Method};
use tonic::Status;
use tonic::body::Body;
use tonic::codegen::Service;
use tonic::codegen::http::{Request, Response};
use tonic::server::NamedService;

use super::status::Explained;
use super::unread::{Flowing, Whole, weight};
use simd_world::SimHandle;
use simd_world::access::Grant;
use simd_world::account::Account;
use simd_world::handle::{CallError, Caller, ClientStream, Peer, Transport};
use simd_world::unread_answers::{LARGE, Reader, Unread};

/// A service whose clients have shares.
#[derive(Clone, Debug)]
pub struct Limited<S> {
    /// Wrapped service.
    pub service: S,
    /// World that counts shares.
    pub handle: SimHandle,
    /// Transport of calls whose extensions name none.
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
        let reader = reader(&request, self.transport);
        request.extensions_mut().insert(reader.account.clone());
        let path = request.uri().path();
        let method = methods::parse_path(path).and_then(|(service, method)| methods::find(service, method));
        match self.admit(&reader, method) {
            Ok(admitted) => {
                let answer = self.service.call(request);
                let handle = self.handle.clone();
                Box::pin(reader.account.scope(async move { Ok(admitted.answer(&handle, answer).await) }))
            }
            Err(refused) => Box::pin(ready(Ok(Status::from(Explained::from(&refused)).into_http()))),
        }
    }
}

impl<S> Limited<S> {
    /// Counts a call, its stream if it is one, and an answer as large as the last ones of its method.
    fn admit(&self, reader: &Reader, method: Option<&'static Method>) -> Result<Admitted, CallError> {
        let handle = &self.handle;
        handle.count_call(&reader.account)?;
        let is_stream = method.is_some_and(|method| method.gives_many);
        let stream = if is_stream { handle.count_stream(&reader.account)? } else { None };
        let expected = method.map_or(0, |method| handle.unread_answers().expected(&method.path));
        let is_large = expected >= LARGE && reader.account != Account::Process;
        if is_large || method.is_some_and(takes_memory) {
            handle.check_memory()?;
        }
        let held = weight(if is_large { expected } else { 0 });
        let unread = handle.unread_answers().hold(reader, held)?;
        Ok(Admitted { method, stream, is_large, unread })
    }
}

/// An admitted call.
struct Admitted {
    method: Option<&'static Method>,
    stream: Option<ClientStream>,
    /// Whether the last answers of its method were large.
    is_large: bool,
    unread: Unread,
}

impl Admitted {
    /// Returns the answer of a service. Its bytes count until its client has read them.
    async fn answer<F>(self, handle: &SimHandle, answer: F) -> Response<Body>
    where
        F: Future<Output = Result<Response<Body>, Infallible>> + Send + 'static,
    {
        let Self { method, stream, is_large, mut unread } = self;
        let Some(method) = method.filter(|method| !method.gives_many) else {
            let Ok(response) = answer.await;
            return Flowing::response(response, unread, stream);
        };
        let whole = match (is_large, is_read_at_once(method)) {
            (false, _) => whole(answer).await,
            (true, true) => apart(handle, whole(answer)).await,
            (true, false) => {
                let Ok(response) = answer.await;
                apart(handle, Whole::of(response)).await
            }
        };
        let whole = match whole {
            Ok(whole) => whole,
            Err(status) => return status.into_http(),
        };
        handle.unread_answers().made(&method.path, whole.encoded_bytes());
        match unread.set(weight(whole.bytes())) {
            Ok(()) => whole.into_response(unread),
            Err(refused) => Status::from(Explained::from(&refused)).into_http(),
        }
    }
}

/// Methods that bring or make what stays in memory.
const TAKE_MEMORY: [&str; 17] = [
    "AddMarkers",
    "AddParameter",
    "CreateSensor",
    "ExpandXacro",
    "ExportSavedState",
    "FollowTrajectory",
    "GetPicture",
    "ImportSavedState",
    "PrepareDescription",
    "PutPicture",
    "ReloadEntity",
    "Rollout",
    "SaveState",
    "SpawnEntity",
    "SpawnEntityWithProgress",
    "UploadAsset",
    "ValidateDescription",
];

fn takes_memory(method: &Method) -> bool {
    TAKE_MEMORY.contains(&name_of(method))
}

fn name_of(method: &Method) -> &str {
    method.path.rsplit('/').next().unwrap_or_default()
}

/// Whether a method makes its answer from what the daemon has, and waits for nothing.
fn is_read_at_once(method: &Method) -> bool {
    let name = name_of(method);
    // These wait for work that is done apart anyway.
    let waits = ["GetPicture", "GetMesh", "GetRecording", "GetMassMatrix", "GetJacobian"];
    (name.starts_with("List") || name.starts_with("Get")) && !waits.contains(&name)
}

async fn whole<F>(answer: F) -> Result<Whole, Status>
where
    F: Future<Output = Result<Response<Body>, Infallible>>,
{
    let Ok(response) = answer.await;
    Whole::of(response).await
}

/// Encodes an answer where it delays no other call.
async fn apart<F>(handle: &SimHandle, whole: F) -> Result<Whole, Status>
where
    F: Future<Output = Result<Whole, Status>> + Send + 'static,
{
    let made = handle.make_large(whole).await;
    made.unwrap_or_else(|refused| Err(Explained::from(&refused).into()))
}

/// Returns the client that a call counts for: its token, otherwise its connection. Zenoh sessions need not
/// identify themselves: sessions with the same name share one share, and so do sessions without a name.
fn reader(request: &Request<Body>, transport: Transport) -> Reader {
    let connection = match request.extensions().get::<Peer>() {
        Some(Peer::Connection { number, .. }) => Some(*number),
        Some(Peer::Session(_) | Peer::Process) | None => None,
    };
    Reader { account: account(request, transport), connection }
}

pub(super) fn account(request: &Request<Body>, transport: Transport) -> Account {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn methods_that_take_memory_are_methods_of_the_schema() {
        let known: Vec<&str> = methods::all().map(|(_, name, _)| name).collect();
        assert!(TAKE_MEMORY.iter().all(|name| known.contains(name)), "{TAKE_MEMORY:?}");
        assert!(TAKE_MEMORY.is_sorted());
    }
}
