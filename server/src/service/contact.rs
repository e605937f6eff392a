//! The contact service: what touches what, and what a ray hits.

use simd_core::simulation::rays::check_rays;
use simd_proto::v1::{self, contact_service_server::ContactService};
use tonic::{Request, Response, Status};

use super::entity::find;
use crate::SimHandle;
use crate::convert::from_proto::contact as from_proto;
use crate::convert::to_proto::{contact as to_proto, stamp};
use crate::handle::{CallError, Cancelled};

/// Serves `simd.v1.ContactService`.
#[derive(Clone, Debug)]
pub struct Service {
    handle: SimHandle,
}

impl Service {
    /// Serves what a handle leads to.
    pub fn new(handle: SimHandle) -> Self {
        Self { handle }
    }
}

#[tonic::async_trait]
impl ContactService for Service {
    async fn get_contacts(
        &self,
        request: Request<v1::GetContactsRequest>,
    ) -> Result<Response<v1::GetContactsResponse>, Status> {
        let robot = from_proto::contacts(request.into_inner())?;
        let state = self.handle.newest();
        let only = robot.map(|robot| find(&state, &robot).map(|(place, _)| place)).transpose()?;
        let is_wanted = |robots: [usize; 2]| only.is_none_or(|only| robots.contains(&only));
        let contacts = to_proto::contacts(&state.state, is_wanted);
        Ok(Response::new(v1::GetContactsResponse { stamp: Some(stamp::published(&state)), contacts }))
    }

    async fn cast_rays(
        &self,
        request: Request<v1::CastRaysRequest>,
    ) -> Result<Response<v1::CastRaysResponse>, Status> {
        let rays = from_proto::rays(request.into_inner())?;
        // Before it waits for a permit with all of them.
        check_rays(&rays).map_err(CallError::World)?;
        let state = self.handle.newest();
        let stamp = Some(stamp::published(&state));
        let cast = move |cancelled: &Cancelled| state.state.cast_rays(&rays, || cancelled.is_set());
        let hits = self.handle.heavy(cast).await?.map_err(CallError::World)?;
        Ok(Response::new(v1::CastRaysResponse { stamp, hits: hits.into_iter().map(to_proto::hit).collect() }))
    }
}
