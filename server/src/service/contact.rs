//! The contact service: what touches what, and what a ray hits.

use simd_core::{Answer, Query};
use simd_proto::v1::{self, contact_service_server::ContactService};
use tonic::{Request, Response, Status};

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

    /// The answer, and the moment that it is of.
    async fn ask(&self, query: Query) -> Result<(Answer, Option<v1::Stamp>), Status> {
        let answer = self.handle.query(query).await?;
        Ok((answer, Some(stamp::published(&self.handle.newest()))))
    }
}

#[tonic::async_trait]
impl ContactService for Service {
    async fn get_contacts(
        &self,
        request: Request<v1::GetContactsRequest>,
    ) -> Result<Response<v1::GetContactsResponse>, Status> {
        match self.ask(from_proto::contacts(request.into_inner())?).await? {
            (Answer::Contacts(contacts), stamp) => Ok(Response::new(v1::GetContactsResponse {
                stamp,
                contacts: contacts.into_iter().map(to_proto::contact).collect(),
            })),
            (other, _) => Err(mismatched(&other).into()),
        }
    }

    async fn cast_rays(
        &self,
        request: Request<v1::CastRaysRequest>,
    ) -> Result<Response<v1::CastRaysResponse>, Status> {
        match self.ask(from_proto::rays(request.into_inner())?).await? {
            (Answer::Rays(hits), stamp) => {
                let hits = hits.into_iter().map(to_proto::hit).collect();
                Ok(Response::new(v1::CastRaysResponse { stamp, hits }))
            }
            (other, _) => Err(mismatched(&other).into()),
        }
    }
}
