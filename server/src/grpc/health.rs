//! `grpc.health.v1`: serving while the physics thread makes progress, until the daemon drains. Unlike with
//! tonic-health, streams end at the drain, so that a watcher delays no shutdown.

use std::future::ready;
use std::time::{Duration, Instant};

use futures_util::{StreamExt as _, stream};
use simd_proto::methods;
use tonic::{Request, Response, Status};
use tonic_health::pb::health_check_response::ServingStatus;
use tonic_health::pb::health_server::Health;
use tonic_health::pb::{HealthCheckRequest, HealthCheckResponse};

use simd_api::service::BoxStream;
use simd_world::SimHandle;

/// Time between two checks for a watcher.
const CHECK_INTERVAL: Duration = Duration::from_secs(1);

/// Reports whether the daemon serves.
#[derive(Clone, Debug)]
pub(super) struct HealthService {
    handle: SimHandle,
}

impl HealthService {
    pub(super) fn new(handle: SimHandle) -> Self {
        Self { handle }
    }

    /// Returns the status of a service by name; an empty name means the whole daemon.
    fn status(&self, service: &str) -> Option<ServingStatus> {
        let serving = match self.handle.readiness(Instant::now()) {
            Ok(()) => ServingStatus::Serving,
            Err(_) => ServingStatus::NotServing,
        };
        let is_known =
            service.is_empty() || service.strip_prefix("simd.v1.").is_some_and(methods::is_service);
        is_known.then_some(serving)
    }

    /// Returns the next status of a service that differs from `last`; `None` once the daemon drains.
    async fn next(&self, service: &str, last: ServingStatus) -> Option<ServingStatus> {
        let draining = self.handle.draining();
        while tokio::time::timeout(CHECK_INTERVAL, draining.cancelled()).await.is_err() {
            let now = self.status(service).unwrap_or(ServingStatus::ServiceUnknown);
            if now != last {
                return Some(now);
            }
        }
        None
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
        let service = request.into_inner().service;
        let now = self.status(&service).unwrap_or(ServingStatus::ServiceUnknown);
        let last = (self.clone(), service, now);
        let changes = stream::unfold(Some(last), async |last| {
            let (own, service, last) = last?;
            match own.next(&service, last).await {
                Some(now) => Some((Ok(response(now)), Some((own, service, now)))),
                None if last == ServingStatus::NotServing => None,
                None => Some((Ok(response(ServingStatus::NotServing)), None)),
            }
        });
        Ok(Response::new(Box::pin(stream::once(ready(Ok(response(now)))).chain(changes))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use simd_world::blocking_threads::BlockingThreads;
    use simd_world::driver;
    use simd_world::driver::fake_world::FakeWorld;
    use simd_world::handle::{DaemonInfo, DaemonLimits, RunState};
    use simd_world::loading::Loader;

    #[tokio::test]
    async fn watchers_learn_that_the_physics_thread_has_ended() {
        let limits = DaemonLimits::default();
        let paused = driver::Config { state: RunState::Paused, ..Default::default() };
        let driver = driver::start(FakeWorld::panicking_at(1), paused).unwrap();
        let loader = Loader::new(limits, &[], BlockingThreads::computing().unwrap()).unwrap();
        let handle = SimHandle::new(driver, loader, DaemonInfo { name: "test".into(), version: "0", limits });
        let service = HealthService::new(handle.clone());
        let asked = Request::new(HealthCheckRequest { service: String::new() });
        let mut watch = service.watch(asked).await.unwrap().into_inner();
        let mut next = async || {
            let next = tokio::time::timeout(Duration::from_secs(30), watch.next()).await.unwrap();
            next.map(|said| said.unwrap().status())
        };
        assert_eq!(next().await, Some(ServingStatus::Serving));
        handle.step(1).await.unwrap_err();
        assert_eq!(next().await, Some(ServingStatus::NotServing));
        handle.draining().cancel();
        assert_eq!(next().await, None, "it has said so");
    }
}
