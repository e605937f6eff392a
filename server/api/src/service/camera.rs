//! The camera service: requests for pictures, and tasks for renderers.

use crate::service::status::OrStatus as _;
use simd_proto::v1::{self, camera_service_server::CameraService};
use tonic::{Request, Response, Status};

use super::calls::handle_of;
use super::file_part::part;
use super::unread::Attachment;
use crate::convert::field::Path;
use crate::convert::from_proto::camera::{self as from_proto, Moment};
use crate::convert::to_proto::{camera as to_proto, stamp};
use simd_world::SimHandle;
use simd_world::handle::{CallError, MeshKey};

/// Serves `simd.v1.CameraService`.
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

#[tonic::async_trait]
impl CameraService for Service {
    async fn list_cameras(
        &self,
        _request: Request<v1::ListCamerasRequest>,
    ) -> Result<Response<v1::ListCamerasResponse>, Status> {
        let (state, cameras, renderers) = self.handle.camera_reports();
        Ok(Response::new(v1::ListCamerasResponse {
            stamp: Some(stamp::published(&state)),
            cameras: cameras.into_iter().map(to_proto::report).collect(),
            renderers: renderers.into_iter().map(to_proto::renderer).collect(),
        }))
    }

    async fn get_picture(
        &self,
        request: Request<v1::GetPictureRequest>,
    ) -> Result<Response<v1::GetPictureResponse>, Status> {
        let handle = handle_of(&self.handle, &request);
        let from_proto::Wanted { robot, sensor, moment, timeout } = from_proto::wanted(request.into_inner())?;
        let picture = match moment {
            Moment::Present => handle.present_picture(&robot, &sensor, timeout).await.or_status()?,
            Moment::Next { after } => {
                handle.next_picture_of(&robot, &sensor, after, timeout).await.or_status()?
            }
        };
        Ok(Response::new(v1::GetPictureResponse { picture: Some(to_proto::picture(&picture)) }))
    }

    async fn take_picture(
        &self,
        request: Request<v1::TakePictureRequest>,
    ) -> Result<Response<v1::TakePictureResponse>, Status> {
        let handle = handle_of(&self.handle, &request);
        let (view, timeout) = from_proto::view(request.into_inner())?;
        let picture = handle.take_picture(view, timeout).await.or_status()?;
        Ok(Response::new(v1::TakePictureResponse { picture: Some(to_proto::picture(&picture)) }))
    }

    async fn next_picture(
        &self,
        request: Request<v1::NextPictureRequest>,
    ) -> Result<Response<v1::NextPictureResponse>, Status> {
        let handle = handle_of(&self.handle, &request);
        let (renderer, timeout) = from_proto::renderer(request.into_inner())?;
        let task = handle.next_picture_task(&renderer, timeout).await.or_status()?;
        let most = self.handle.info().limits.message_bytes;
        Ok(Response::new(v1::NextPictureResponse { task: task.map(|task| to_proto::task(&task, most)) }))
    }

    async fn put_picture(
        &self,
        request: Request<v1::PutPictureRequest>,
    ) -> Result<Response<v1::PutPictureResponse>, Status> {
        let handle = handle_of(&self.handle, &request);
        let from_proto::Put { id, renderer, drawn } = from_proto::put(request.into_inner())?;
        let accepted = handle.put_picture(id, &renderer, drawn).await.or_status()?;
        Ok(Response::new(v1::PutPictureResponse { accepted }))
    }

    async fn get_mesh(
        &self,
        request: Request<v1::GetMeshRequest>,
    ) -> Result<Response<v1::GetMeshResponse>, Status> {
        let handle = handle_of(&self.handle, &request);
        let request = request.into_inner();
        let sha256 = from_proto::mesh(&request)?;
        let mesh = handle.meshes().get(&handle, MeshKey::Mesh(sha256)).await.or_status()?;
        let mesh = mesh
            .ok_or_else(|| CallError::AssetNotUploaded { uri: String::new(), sha256: sha256.to_string() })
            .or_status()?;
        let total_bytes = mesh.bytes.len() as u64;
        let bytes = part(&mesh.bytes, request.offset, request.max_bytes).ok_or_else(|| {
            let expected = format!("it must be at most the mesh's size, {total_bytes}");
            Path::ROOT.field("offset").refuse(request.offset, expected)
        })?;
        let mut response = Response::new(v1::GetMeshResponse { data: Vec::new(), total_bytes });
        response.extensions_mut().insert(Attachment { field: 1, bytes });
        Ok(response)
    }
}
