//! The contact service: what touches what, and what a ray hits.

use simd_core::Answer;
use simd_proto::v1::{self, contact_service_server::ContactService};
use tonic::{Request, Response, Status};

use super::entity::find;
use super::mismatched;
use crate::SimHandle;
use crate::convert::from_proto::contact as from_proto;
use crate::convert::to_proto::{contact as to_proto, stamp};

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
        let contacts = to_proto::contacts(&state.snapshot, is_wanted);
        Ok(Response::new(v1::GetContactsResponse { stamp: Some(stamp::published(&state)), contacts }))
    }

    async fn cast_rays(
        &self,
        request: Request<v1::CastRaysRequest>,
    ) -> Result<Response<v1::CastRaysResponse>, Status> {
        match self.handle.query(from_proto::rays(request.into_inner())?).await? {
            Answer::Rays(hits) => {
                let hits = hits.into_iter().map(to_proto::hit).collect();
                let stamp = Some(stamp::published(&self.handle.newest()));
                Ok(Response::new(v1::CastRaysResponse { stamp, hits }))
            }
            other => Err(mismatched(&other).into()),
        }
    }
}
