//! `grpc.health.v1`: serving as long as the physics thread gets on, until the daemon drains. Unlike the service that
//! tonic-health brings, its streams end then, so that a watcher holds up no shutdown.

use std::future::ready;
use std::time::Instant;

use futures_util::{StreamExt as _, stream};
use simd_proto::methods;
use tonic::{Request, Response, Status};
use tonic_health::pb::health_check_response::ServingStatus;
use tonic_health::pb::health_server::Health;
use tonic_health::pb::{HealthCheckRequest, HealthCheckResponse};

use crate::SimHandle;
use crate::service::BoxStream;

/// Says whether the daemon serves.
#[derive(Debug)]
pub(super) struct HealthService {
    handle: SimHandle,
}

impl HealthService {
    pub(super) fn new(handle: SimHandle) -> Self {
        Self { handle }
    }

    /// Of a service by name; empty for the daemon as a whole.
    fn status(&self, service: &str) -> Option<ServingStatus> {
        let serving = match self.handle.readiness(Instant::now()) {
            Ok(()) => ServingStatus::Serving,
            Err(_) => ServingStatus::NotServing,
        };
        let is_known =
            service.is_empty() || service.strip_prefix("simd.v1.").is_some_and(methods::is_service);
        is_known.then_some(serving)
    }
}

fn response(status: ServingStatus) -> HealthCheckResponse {
    HealthCheckResponse { status: status.into() }
}

#[tonic::async_trait]
impl Health for HealthService {
    async fn check(
        &self,
        request: Request<HealthCheckRequest>,
    ) -> Result<Response<HealthCheckResponse>, Status> {
        let service = request.into_inner().service;
        let status = self.status(&service).ok_or_else(|| Status::not_found("no such service"))?;
        Ok(Response::new(response(status)))
    }

    type WatchStream = BoxStream<HealthCheckResponse>;

    async fn watch(
        &self,
        request: Request<HealthCheckRequest>,
    ) -> Result<Response<Self::WatchStream>, Status> {
        let now = self.status(&request.into_inner().service).unwrap_or(ServingStatus::ServiceUnknown);
        let draining = self.handle.draining();
        let last = async move {
            draining.cancelled().await;
            Ok(response(ServingStatus::NotServing))
        };
        Ok(Response::new(Box::pin(stream::once(ready(Ok(response(now)))).chain(stream::once(last)))))
    }
}
