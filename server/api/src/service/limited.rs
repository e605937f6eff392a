//! Limits each client to its share.

use simd_proto::methods::Method;
use tonic::Status;
use tonic::body::Body;
use tonic::codegen::http::Response;

use super::status::Explained;
use super::unread::{Flowing, Whole, weight};
use simd_world::SimHandle;
use simd_world::account::Account;
use simd_world::handle::{CallContext, CallError, ClientStream, Peer};
use simd_world::unread_answers::{LARGE, Reader, Unread};

/// Counts a call, its stream if it is one, and an answer as large as the last ones of its method.
pub(super) fn admit(handle: &SimHandle, method: Option<&'static Method>) -> Result<Admitted, Status> {
    try_admit(handle, method).map_err(|refused| Explained::from(&refused).into())
}

fn try_admit(handle: &SimHandle, method: Option<&'static Method>) -> Result<Admitted, CallError> {
    let CallContext { account, peer, .. } = handle.call();
    handle.count_call()?;
    let is_stream = method.is_some_and(|method| method.gives_many);
    let stream = if is_stream { handle.count_stream()? } else { None };
    let expected = method.map_or(0, |method| handle.unread_answers().expected(&method.path));
    let is_large = expected >= LARGE && *account != Account::Process;
    if is_large || method.is_some_and(takes_memory) {
        handle.check_memory()?;
    }
    let held = weight(if is_large { expected } else { 0 });
    let connection = match peer {
        Some(Peer::Connection { number, .. }) => Some(*number),
        Some(Peer::Session(_) | Peer::Process) | None => None,
    };
    let unread = handle.unread_answers().hold(&Reader { account: account.clone(), connection }, held)?;
    Ok(Admitted { method, stream, is_large, unread })
}

/// An admitted call.
pub(super) struct Admitted {
    method: Option<&'static Method>,
    stream: Option<ClientStream>,
    /// Whether the last answers of its method were large.
    is_large: bool,
    unread: Unread,
}

impl Admitted {
    /// Returns the answer of a service. Its bytes count until its client has read them.
    pub(super) async fn answer<F>(self, handle: &SimHandle, answer: F) -> Response<Body>
    where
        F: Future<Output = Response<Body>> + Send + 'static,
    {
        let Self { method, stream, is_large, mut unread } = self;
        let Some(method) = method.filter(|method| !method.gives_many) else {
            let response = answer.await;
            return Flowing::response(response, unread, stream);
        };
        let whole = match (is_large, is_read_at_once(method)) {
            (false, _) => whole(answer).await,
            (true, true) => apart(handle, whole(answer)).await,
            (true, false) => {
                let response = answer.await;
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

async fn whole(answer: impl Future<Output = Response<Body>>) -> Result<Whole, Status> {
    Whole::of(answer.await).await
}

/// Encodes an answer where it delays no other call.
async fn apart<F>(handle: &SimHandle, whole: F) -> Result<Whole, Status>
where
    F: Future<Output = Result<Whole, Status>> + Send + 'static,
{
    let made = handle.make_large(whole).await;
    made.unwrap_or_else(|refused| Err(Explained::from(&refused).into()))
}

#[cfg(test)]
mod tests {
    use simd_proto::methods;

    use super::*;

    #[test]
    fn methods_that_take_memory_are_methods_of_the_schema() {
        let known: Vec<&str> = methods::all().map(|(_, name, _)| name).collect();
        assert!(TAKE_MEMORY.iter().all(|name| known.contains(name)), "{TAKE_MEMORY:?}");
        assert!(TAKE_MEMORY.is_sorted());
    }
}
