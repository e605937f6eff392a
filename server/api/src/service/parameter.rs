//! The parameter service: sliders and buttons that programs add and people move.

use crate::service::status::OrStatus as _;
use futures_util::stream;
use simd_proto::v1::{self, parameter_service_server::ParameterService};
use tonic::{Request, Response, Status};

use super::BoxStream;
use super::authorization::may_take_over;
use super::once::once;
use crate::convert::from_proto::parameter::{self as from_proto, Added};
use crate::convert::to_proto::{parameter as to_proto, stamp};
use simd_world::SimHandle;
use simd_world::handle::{CallError, ParameterList};

/// Serves `simd.v1.ParameterService`.
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

fn now(handle: &SimHandle) -> Option<v1::Stamp> {
    Some(stamp::published(&handle.newest()))
}

fn whole(handle: &SimHandle, list: &ParameterList) -> v1::ParameterList {
    to_proto::list(list.version, &list.parameters, &handle.newest())
}

#[tonic::async_trait]
impl ParameterService for Service {
    async fn add_parameter(
        &self,
        request: Request<v1::AddParameterRequest>,
    ) -> Result<Response<v1::AddParameterResponse>, Status> {
        may_take_over(&request, request.get_ref().take_over, "AddParameter")?;
        once(&self.handle, request, |handle, request| async move {
            let handle = handle.taking_over(request.take_over);
            let Added { name, kind, binding, taken } = from_proto::add(request)?;
            let added = match binding {
                Some(binding) => handle.add_bound_slider(&name, kind, binding, taken)?,
                None => handle.add_parameter(&name, kind, taken)?,
            };
            let parameter = Some(to_proto::parameter(&added));
            Ok(v1::AddParameterResponse { parameter, stamp: now(&handle) })
        })
        .await
    }

    async fn set_parameters(
        &self,
        request: Request<v1::SetParametersRequest>,
    ) -> Result<Response<v1::SetParametersResponse>, Status> {
        once(&self.handle, request, |handle, request| async move {
            let changes = from_proto::changes(request.changes)?;
            let set = handle.move_parameters(&changes).await?;
            let parameters = set.iter().map(to_proto::parameter).collect();
            Ok(v1::SetParametersResponse { parameters, stamp: now(&handle) })
        })
        .await
    }

    async fn get_parameters(
        &self,
        request: Request<v1::GetParametersRequest>,
    ) -> Result<Response<v1::GetParametersResponse>, Status> {
        let names = from_proto::names(request.into_inner().names)?;
        let list = self.handle.parameters();
        let list = if names.is_empty() {
            whole(&self.handle, &list)
        } else {
            let found =
                names.iter().map(|name| list.find(name)).collect::<Result<Vec<_>, _>>().or_status()?;
            to_proto::list(list.version, found, &self.handle.newest())
        };
        Ok(Response::new(v1::GetParametersResponse { list: Some(list) }))
    }

    async fn next_parameters(
        &self,
        request: Request<v1::NextParametersRequest>,
    ) -> Result<Response<v1::NextParametersResponse>, Status> {
        let request = request.into_inner();
        let timeout = from_proto::next_timeout(request.timeout)?;
        let list = self.handle.next_parameters(request.after_version, Some(timeout)).await.or_status()?;
        Ok(Response::new(v1::NextParametersResponse { list: Some(whole(&self.handle, &list)) }))
    }

    type WatchParametersStream = BoxStream<v1::WatchParametersResponse>;

    async fn watch_parameters(
        &self,
        _request: Request<v1::WatchParametersRequest>,
    ) -> Result<Response<Self::WatchParametersStream>, Status> {
        let watcher = Watcher { handle: self.handle.clone(), sent: 0 };
        Ok(Response::new(Box::pin(stream::try_unfold(watcher, Watcher::next))))
    }

    async fn remove_parameters(
        &self,
        request: Request<v1::RemoveParametersRequest>,
    ) -> Result<Response<v1::RemoveParametersResponse>, Status> {
        may_take_over(&request, request.get_ref().take_over, "RemoveParameters")?;
        once(&self.handle, request, |handle, request| async move {
            let handle = handle.taking_over(request.take_over);
            let removed = handle.remove_parameters(&from_proto::names(request.names)?)?;
            Ok(v1::RemoveParametersResponse { removed, stamp: now(&handle) })
        })
        .await
    }
}

/// A watcher. The list is read when the network asks for the next one.
struct Watcher {
    handle: SimHandle,
    /// Version of the last sent list; 0 for none.
    sent: u64,
}

impl Watcher {
    async fn next(mut self) -> Result<Option<(v1::WatchParametersResponse, Self)>, Status> {
        if self.handle.draining().is_cancelled() {
            return Ok(None);
        }
        let list = match self.handle.next_parameters(self.sent, None).await {
            Ok(list) => list,
            Err(CallError::ShuttingDown) => return Ok(None),
            Err(error) => return Err(error).or_status(),
        };
        self.sent = list.version;
        let list = Some(whole(&self.handle, &list));
        Ok(Some((v1::WatchParametersResponse { list }, self)))
    }
}
