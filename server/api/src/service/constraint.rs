//! The constraint service: constraints between links, in addition to the joints of their robots.

use crate::service::status::OrStatus as _;
use simd_core::{Command, Reply};
use simd_proto::v1::{self, constraint_service_server::ConstraintService};
use tonic::{Request, Response, Status};

use super::entity::find;
use super::mismatched;
use super::once::once;
use crate::convert::from_proto::constraint as from_proto;
use crate::convert::to_proto::{constraint as to_proto, stamp};
use simd_world::SimHandle;

/// Serves `simd.v1.ConstraintService`.
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
impl ConstraintService for Service {
    async fn create_constraint(
        &self,
        request: Request<v1::CreateConstraintRequest>,
    ) -> Result<Response<v1::CreateConstraintResponse>, Status> {
        once(&self.handle, request, |handle, request| async move {
            let create = from_proto::create(request)?;
            let done = handle.command(Command::CreateConstraint(Box::new(create))).await?;
            let stamp = Some(stamp::done(&done));
            match done.applied.reply {
                Reply::ConstraintCreated { name } => Ok(v1::CreateConstraintResponse { name, stamp }),
                other => Err(mismatched(&other).into()),
            }
        })
        .await
    }

    async fn change_constraint(
        &self,
        request: Request<v1::ChangeConstraintRequest>,
    ) -> Result<Response<v1::ChangeConstraintResponse>, Status> {
        once(&self.handle, request, |handle, request| async move {
            let change = from_proto::change(request)?;
            let done = handle.command(Command::ChangeConstraint(Box::new(change))).await?;
            Ok(v1::ChangeConstraintResponse { stamp: Some(stamp::done(&done)) })
        })
        .await
    }

    async fn delete_constraint(
        &self,
        request: Request<v1::DeleteConstraintRequest>,
    ) -> Result<Response<v1::DeleteConstraintResponse>, Status> {
        once(&self.handle, request, |handle, request| async move {
            let name = from_proto::name(request.name)?;
            let done = handle.command(Command::DeleteConstraint { name }).await?;
            Ok(v1::DeleteConstraintResponse { stamp: Some(stamp::done(&done)) })
        })
        .await
    }

    async fn list_constraints(
        &self,
        request: Request<v1::ListConstraintsRequest>,
    ) -> Result<Response<v1::ListConstraintsResponse>, Status> {
        let robot = from_proto::only(request.into_inner())?;
        let state = self.handle.newest();
        let only = robot.map(|robot| find(&state, &robot).map(|(index, _)| index)).transpose().or_status()?;
        let constraints = to_proto::constraints(&state.state, only);
        Ok(Response::new(v1::ListConstraintsResponse { stamp: Some(stamp::published(&state)), constraints }))
    }
}
