//! Answers of a method: one, or all of a stream, within a time.

use std::time::Duration;

use bytes::Bytes;
use futures_util::stream;
use simd_proto::methods::Method;
use simd_proto::raw::RawCodec;
use tonic::client::Grpc;
use tonic::codegen::http::uri::PathAndQuery;
use tonic::service::Routes;
use tonic::{Request, Status, Streaming};

use super::notices::{Notifier, Ticket, What};

/// A call that is ready to be made.
pub(super) struct Prepared {
    pub(super) method: &'static Method,
    pub(super) request: Request<stream::Iter<std::array::IntoIter<Bytes, 1>>>,
    pub(super) services: Routes,
}

/// Returns the answers of a method.
async fn answers(prepared: Prepared) -> Result<Streaming<Bytes>, Status> {
    let Prepared { method, request, services } = prepared;
    // Answers may have any length, as over gRPC: a scene may be long.
    let mut services = Grpc::new(services).max_decoding_message_size(usize::MAX);
    let never = |error| Status::internal(format!("the services are not ready: {error}"));
    services.ready().await.map_err(never)?;
    let path = PathAndQuery::from_static(&method.path);
    Ok(services.streaming(request, path, RawCodec).await?.into_inner())
}

/// Returns the only or first answer of a method.
pub(super) async fn answer(prepared: Prepared) -> Result<Bytes, Status> {
    let first = answers(prepared).await?.message().await?;
    first.ok_or_else(|| Status::internal("the method gave no answer"))
}

/// Sends all answers of a stream, each as a notice.
pub(super) async fn notify_of_all(
    prepared: Prepared,
    time_limit: Duration,
    ticket: Ticket,
    notifier: &Notifier,
) -> Result<(), Status> {
    let all = async {
        let mut answers = answers(prepared).await?;
        while let Some(answer) = answers.message().await? {
            notifier.notify(ticket, What::Answer(answer)).await;
        }
        // Its end is reported as over Zenoh.
        Err(Status::ok("the stream ended"))
    };
    within(time_limit, all).await
}

pub(super) async fn within<T>(
    time_limit: Duration,
    work: impl Future<Output = Result<T, Status>>,
) -> Result<T, Status> {
    tokio::time::timeout(time_limit, work).await.unwrap_or_else(|_elapsed| Err(late(time_limit)))
}

pub(super) fn late(time_limit: Duration) -> Status {
    Status::deadline_exceeded(format!("the world did not answer within {} s", time_limit.as_secs_f64()))
}
