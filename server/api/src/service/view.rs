//! The view service: drawings of programs in pages, cameras of pages, and input from keyboard and mouse.

use crate::service::status::OrStatus as _;
use simd_proto::v1::{self, view_service_server::ViewService};
use tokio::time::Instant;
use tonic::{Request, Response, Status};

use super::authorization::may_take_over;
use super::calls::context;
use super::joint::no_connection;
use super::once::once;
use crate::convert::from_proto::view as from_proto;
use crate::convert::to_proto::view as to_proto;
use simd_world::SimHandle;
use simd_world::handle::{CallError, Disconnect};

/// Serves `simd.v1.ViewService`.
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

/// Returns the refusal of a page without a name, since pages are distinguished by their names.
fn no_name() -> CallError {
    CallError::InvalidValue {
        element: "the client's name".into(),
        value: "not given".into(),
        expected: format!("a page must give it in the header {}", simd_proto::CLIENT_HEADER),
    }
}

#[tonic::async_trait]
impl ViewService for Service {
    async fn add_markers(
        &self,
        request: Request<v1::AddMarkersRequest>,
    ) -> Result<Response<v1::AddMarkersResponse>, Status> {
        may_take_over(&request, request.get_ref().take_over, "AddMarkers")?;
        let disconnect = request.extensions().get::<Disconnect>().cloned();
        once(&self.handle, request, |handle, request| async move {
            let until = match request.until_disconnect {
                true => Some(disconnect.ok_or_else(no_connection)?.0),
                false => None,
            };
            let markers = from_proto::markers(request.markers)?;
            let ids = handle.taking_over(request.take_over).add_markers(markers, until.as_ref())?;
            Ok(v1::AddMarkersResponse { ids })
        })
        .await
    }

    async fn delete_markers(
        &self,
        request: Request<v1::DeleteMarkersRequest>,
    ) -> Result<Response<v1::DeleteMarkersResponse>, Status> {
        may_take_over(&request, request.get_ref().take_over, "DeleteMarkers")?;
        once(&self.handle, request, |handle, request| async move {
            let deleted = handle.taking_over(request.take_over).delete_markers(&request.ids)?;
            Ok(v1::DeleteMarkersResponse { deleted })
        })
        .await
    }

    async fn list_markers(
        &self,
        _request: Request<v1::ListMarkersRequest>,
    ) -> Result<Response<v1::ListMarkersResponse>, Status> {
        let (version, markers) = self.handle.markers();
        let now = Instant::now();
        let markers = markers.iter().map(|marker| to_proto::marker(marker, now)).collect();
        Ok(Response::new(v1::ListMarkersResponse { version, markers }))
    }

    async fn next_view(
        &self,
        request: Request<v1::NextViewRequest>,
    ) -> Result<Response<v1::NextViewResponse>, Status> {
        let caller = context(request.extensions()).caller;
        let request = request.into_inner();
        let timeout = from_proto::next_timeout(request.timeout)?;
        let change =
            self.handle.next_view(request.after_version, timeout, caller.as_ref()).await.or_status()?;
        Ok(Response::new(to_proto::change(&change, Instant::now())))
    }

    async fn report_view(
        &self,
        request: Request<v1::ReportViewRequest>,
    ) -> Result<Response<v1::ReportViewResponse>, Status> {
        let page = context(request.extensions()).caller.ok_or_else(no_name).or_status()?;
        let v1::ReportViewRequest { camera, followed_version, input } = request.into_inner();
        let (camera, input) = (camera.map(from_proto::camera).transpose()?, from_proto::input(input)?);
        self.handle.report_camera(&page, camera, followed_version);
        let wants_input = self.handle.report_input(&page, input);
        Ok(Response::new(v1::ReportViewResponse { wants_input }))
    }

    async fn set_camera(
        &self,
        request: Request<v1::SetCameraRequest>,
    ) -> Result<Response<v1::SetCameraResponse>, Status> {
        once(&self.handle, request, |handle, request| async move {
            let (position, target, field_of_view) = from_proto::set_camera(&request)?;
            let version = handle.set_camera(position, target, field_of_view);
            Ok(v1::SetCameraResponse { version })
        })
        .await
    }

    async fn set_link_colors(
        &self,
        request: Request<v1::SetLinkColorsRequest>,
    ) -> Result<Response<v1::SetLinkColorsResponse>, Status> {
        once(&self.handle, request, |handle, request| async move {
            handle.set_link_colors(from_proto::link_colors(request.colors)?)?;
            Ok(v1::SetLinkColorsResponse {})
        })
        .await
    }

    async fn get_cameras(
        &self,
        _request: Request<v1::GetCamerasRequest>,
    ) -> Result<Response<v1::GetCamerasResponse>, Status> {
        let (pages, target) = self.handle.cameras();
        let cameras = pages.iter().map(to_proto::page_camera).collect();
        Ok(Response::new(v1::GetCamerasResponse { cameras, camera: target.map(to_proto::camera_target) }))
    }

    async fn next_input(
        &self,
        request: Request<v1::NextInputRequest>,
    ) -> Result<Response<v1::NextInputResponse>, Status> {
        let caller = context(request.extensions()).caller;
        let request = request.into_inner();
        let timeout = from_proto::next_timeout(request.timeout)?;
        let input =
            self.handle.next_input(request.after_sequence, timeout, caller.as_ref()).await.or_status()?;
        let events = input.events.iter().map(|event| to_proto::input(event)).collect();
        let (sequence, missed) = (input.sequence, input.missed);
        Ok(Response::new(v1::NextInputResponse { sequence, events, missed }))
    }
}
