//! The recording service: recordings of the world on the daemon's disk.

use crate::service::status::OrStatus as _;
use simd_core::Moment;
use simd_proto::v1::{self, recording_service_server::RecordingService};
use tonic::{Request, Response, Status};

use super::calls::handle_of;
use super::once::once;
use crate::convert::from_proto::recording as from_proto;
use crate::convert::to_proto::{recording as to_proto, stamp};
use simd_world::SimHandle;

/// Maximum size of a part of a file, bytes. It fits into a message that every client accepts.
const MAX_PART: u64 = 1 << 20;

/// Serves `simd.v1.RecordingService`.
#[derive(Clone, Debug)]
pub struct Service {
    handle: SimHandle,
}

impl Service {
    /// Serves the world of a handle.
    pub fn new(handle: SimHandle) -> Self {
        Self { handle }
    }
}

/// Returns a moment between two steps, with the newest state that was published by then.
fn stamp_at(handle: &SimHandle, at: Moment) -> Option<v1::Stamp> {
    let newest = handle.newest();
    Some(stamp::stamp(at, Some(newest.wall_time), newest.sequence))
}

#[tonic::async_trait]
impl RecordingService for Service {
    async fn start_recording(
        &self,
        request: Request<v1::StartRecordingRequest>,
    ) -> Result<Response<v1::StartRecordingResponse>, Status> {
        once(&self.handle, request, |handle, request| async move {
            let (info, at) = handle.start_recording(from_proto::start(request)?).await?;
            let recording = Some(to_proto::recording(info));
            Ok(v1::StartRecordingResponse { recording, stamp: stamp_at(&handle, at) })
        })
        .await
    }

    async fn stop_recording(
        &self,
        request: Request<v1::StopRecordingRequest>,
    ) -> Result<Response<v1::StopRecordingResponse>, Status> {
        once(&self.handle, request, |handle, request| async move {
            let (info, at) = handle.stop_recording(&request.name).await?;
            let recording = Some(to_proto::recording(info));
            Ok(v1::StopRecordingResponse { recording, stamp: stamp_at(&handle, at) })
        })
        .await
    }

    async fn list_recordings(
        &self,
        request: Request<v1::ListRecordingsRequest>,
    ) -> Result<Response<v1::ListRecordingsResponse>, Status> {
        let handle = handle_of(&self.handle, &request);
        let recordings = handle.recordings().await.or_status()?;
        let recordings = recordings.into_iter().map(to_proto::recording).collect();
        Ok(Response::new(v1::ListRecordingsResponse { recordings }))
    }

    async fn get_recording(
        &self,
        request: Request<v1::GetRecordingRequest>,
    ) -> Result<Response<v1::GetRecordingResponse>, Status> {
        let handle = handle_of(&self.handle, &request);
        let name = from_proto::name("name", request.into_inner().name)?;
        let (info, contents) = handle.recording_contents(name).await.or_status()?;
        Ok(Response::new(to_proto::contents(info, contents)))
    }

    async fn read_recording(
        &self,
        request: Request<v1::ReadRecordingRequest>,
    ) -> Result<Response<v1::ReadRecordingResponse>, Status> {
        let handle = handle_of(&self.handle, &request);
        let v1::ReadRecordingRequest { name, file, offset, max_bytes } = request.into_inner();
        let name = from_proto::name("name", name)?;
        let most = if max_bytes == 0 { MAX_PART } else { max_bytes.min(MAX_PART) };
        let most = usize::try_from(most).unwrap_or(usize::MAX);
        let (data, total_bytes) = handle.read_recording(name, file, offset, most).await.or_status()?;
        Ok(Response::new(v1::ReadRecordingResponse { data, total_bytes }))
    }

    async fn delete_recording(
        &self,
        request: Request<v1::DeleteRecordingRequest>,
    ) -> Result<Response<v1::DeleteRecordingResponse>, Status> {
        once(&self.handle, request, |handle, request| async move {
            handle.delete_recording(from_proto::name("name", request.name)?).await?;
            Ok(v1::DeleteRecordingResponse {})
        })
        .await
    }
}
