//! The services of `simd.v1`, once for every transport: a request is parsed by `convert`, done by
//! [`SimHandle`], and answered by `convert`.
//!
//! * [`simulation`], [`entity`], [`joint`], [`event`], [`parameter`]: one file a service.
//! * [`control`]: the stream that controllers use.
//! * `spawning`: the stream of those who wait for a robot.
//! * [`status`]: why a call is refused.
//! * [`transport`]: reasons for what tonic itself refuses.
//! * [`version`]: which clients are served.

pub mod control;
pub mod entity;
pub mod event;
pub mod joint;
pub mod parameter;
pub mod simulation;
mod spawning;
pub mod status;
pub mod transport;
pub mod version;

use std::pin::Pin;

use simd_core::Command;
use simd_proto::v1::entity_service_server::EntityServiceServer;
use simd_proto::v1::event_service_server::EventServiceServer;
use simd_proto::v1::joint_service_server::JointServiceServer;
use simd_proto::v1::parameter_service_server::ParameterServiceServer;
use simd_proto::v1::simulation_service_server::SimulationServiceServer;
use tokio_stream::Stream;
use tonic::Status;
use tonic::service::Routes;

use self::transport::Reasoned;
use self::version::Versioned;
use crate::SimHandle;
use crate::handle::{CallError, Done};

/// The answers of a stream.
pub(crate) type BoxStream<T> = Pin<Box<dyn Stream<Item = Result<T, Status>> + Send>>;

/// All services. Each front-end serves these, and has no call of its own.
pub fn routes(handle: &SimHandle) -> Routes {
    let limit = usize::try_from(handle.info().limits.message_bytes).unwrap_or(usize::MAX);
    let simulation = simulation::Service::new(handle.clone());
    let entity = entity::Service::new(handle.clone());
    let joint = joint::Service::new(handle.clone());
    let event = event::Service::new(handle.clone());
    let parameter = parameter::Service::new(handle.clone());
    Routes::default()
        .add_service(checked(SimulationServiceServer::new(simulation).max_decoding_message_size(limit)))
        .add_service(checked(EntityServiceServer::new(entity).max_decoding_message_size(limit)))
        .add_service(checked(JointServiceServer::new(joint).max_decoding_message_size(limit)))
        .add_service(checked(EventServiceServer::new(event).max_decoding_message_size(limit)))
        .add_service(checked(ParameterServiceServer::new(parameter).max_decoding_message_size(limit)))
}

/// For clients of a fitting version, and with a reason for each refusal.
fn checked<S>(service: S) -> Versioned<Reasoned<S>> {
    Versioned(Reasoned(service))
}

/// Does a command once for each request id.
async fn command_once(handle: &SimHandle, request_id: &str, command: Command) -> Result<Done, CallError> {
    let doer = handle.clone();
    handle.once(request_id, async move { doer.command(command).await }).await
}

/// A question was answered with the answer to another one.
fn mismatched<T>(what: &T) -> CallError
where
    T: std::fmt::Debug,
{
    CallError::Internal { message: format!("this is no answer: {what:?}") }
}
