//! The client service: connected clients, and owners of joint targets.

use simd_proto::v1::{self, client_service_server::ClientService};
use tonic::{Request, Response, Status};

use super::calls::context;
use simd_world::SimHandle;
use simd_world::handle::{Client, TargetSource};

/// Serves `simd.v1.ClientService`.
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
impl ClientService for Service {
    async fn list_clients(
        &self,
        request: Request<v1::ListClientsRequest>,
    ) -> Result<Response<v1::ListClientsResponse>, Status> {
        let asks = context(request.extensions()).caller;
        let client = |Client { caller, idle }: Client| v1::ClientInfo {
            name: caller.name.to_string(),
            idle: idle.as_secs_f64(),
            is_caller: asks.as_ref() == Some(&caller),
            transport: caller.transport.name().to_owned(),
        };
        let target = |TargetSource { robot, joint, client, age }: TargetSource| v1::TargetSource {
            robot,
            joint,
            client: client.to_string(),
            age: age.as_secs_f64(),
        };
        Ok(Response::new(v1::ListClientsResponse {
            clients: self.handle.clients().into_iter().map(client).collect(),
            targets: self.handle.target_sources().into_iter().map(target).collect(),
        }))
    }
}
