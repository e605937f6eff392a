//! Services of `simd.v1`, once for every transport: `convert` parses a request, [`SimHandle`] executes it,
//! and `convert` makes the answer.
//!
//! * [`simulation`], [`entity`], [`joint`], [`event`], [`parameter`], [`kinematics`], [`contact`],
//!   [`constraint`], [`camera`], [`client`], [`recording`], [`rollout`], [`sensor`], [`view`]: one file per
//!   service.
//! * `calls`: what each call passes before its service, and its context.
//! * [`authorization`]: rights of callers. `limited`: the share of each client. `counted`: numbers of calls.
//! * [`claims`]: the claim that a call acts for.
//! * [`control`]: the stream for controllers.
//! * `once`: requests that arrive more than once.
//! * `spawning`: the stream that reports a spawn's progress.
//! * [`status`]: refusals of calls.
//! * [`transport`]: reasons for tonic's own refusals.
//! * [`unread`]: answers that clients have yet to read.
//! * [`version`]: supported versions of clients.

pub mod authorization;
mod calls;
pub mod camera;
pub mod claims;
pub mod client;
pub mod constraint;
pub mod contact;
pub mod control;
pub mod counted;
pub mod entity;
pub mod event;
mod file_part;
mod held;
pub mod joint;
pub mod kinematics;
mod limited;
mod once;
pub mod parameter;
pub mod recording;
pub mod rollout;
pub mod sensor;
pub mod simulation;
mod spawning;
pub mod status;
#[cfg(test)]
mod tests;
pub mod transport;
pub mod unread;
pub mod version;
pub mod view;
mod watched;

use std::pin::Pin;
use std::sync::Arc;

use axum::middleware;
use simd_core::simulation::joint_status::JointStatus;
use simd_core::simulation::published_state::EntityLayout;
use simd_proto::v1::camera_service_server::CameraServiceServer;
use simd_proto::v1::client_service_server::ClientServiceServer;
use simd_proto::v1::constraint_service_server::ConstraintServiceServer;
use simd_proto::v1::contact_service_server::ContactServiceServer;
use simd_proto::v1::entity_service_server::EntityServiceServer;
use simd_proto::v1::event_service_server::EventServiceServer;
use simd_proto::v1::joint_service_server::JointServiceServer;
use simd_proto::v1::kinematics_service_server::KinematicsServiceServer;
use simd_proto::v1::parameter_service_server::ParameterServiceServer;
use simd_proto::v1::recording_service_server::RecordingServiceServer;
use simd_proto::v1::rollout_service_server::RolloutServiceServer;
use simd_proto::v1::sensor_service_server::SensorServiceServer;
use simd_proto::v1::simulation_service_server::SimulationServiceServer;
use simd_proto::v1::view_service_server::ViewServiceServer;
use tokio_stream::Stream;
use tonic::Status;
use tonic::service::Routes;

use self::calls::Entrance;
use simd_world::SimHandle;
use simd_world::account::Account;
use simd_world::handle::{CallContext, CallError, Published, Transport};

/// Answers of a stream.
pub type BoxStream<T> = Pin<Box<dyn Stream<Item = Result<T, Status>> + Send>>;

/// Returns all services. Each front-end serves these and has no other methods.
pub fn routes(handle: &SimHandle, transport: Transport) -> Routes {
    // A service that forgets the context of its call has the limits of an unknown client.
    let handle = &handle.of_call(CallContext::of(Account::Unknown));
    let limit = usize::try_from(handle.info().limits.message_bytes).unwrap_or(usize::MAX);
    let simulation = simulation::Service::new(handle.clone());
    let camera = camera::Service::new(handle.clone());
    let client = client::Service::new(handle.clone());
    let constraint = constraint::Service::new(handle.clone());
    let contact = contact::Service::new(handle.clone());
    let entity = entity::Service::new(handle.clone());
    let joint = joint::Service::new(handle.clone());
    let event = event::Service::new(handle.clone());
    let parameter = parameter::Service::new(handle.clone());
    let kinematics = kinematics::Service::new(handle.clone());
    let recording = recording::Service::new(handle.clone());
    let sensor = sensor::Service::new(handle.clone());
    let view = view::Service::new(handle.clone());
    let rollout = rollout::Service::new(handle.clone());
    let routes = Routes::default()
        .add_service(SimulationServiceServer::new(simulation).max_decoding_message_size(limit))
        .add_service(CameraServiceServer::new(camera).max_decoding_message_size(limit))
        .add_service(ClientServiceServer::new(client).max_decoding_message_size(limit))
        .add_service(ConstraintServiceServer::new(constraint).max_decoding_message_size(limit))
        .add_service(ContactServiceServer::new(contact).max_decoding_message_size(limit))
        .add_service(EntityServiceServer::new(entity).max_decoding_message_size(limit))
        .add_service(JointServiceServer::new(joint).max_decoding_message_size(limit))
        .add_service(EventServiceServer::new(event).max_decoding_message_size(limit))
        .add_service(ParameterServiceServer::new(parameter).max_decoding_message_size(limit))
        .add_service(RecordingServiceServer::new(recording).max_decoding_message_size(limit))
        .add_service(SensorServiceServer::new(sensor).max_decoding_message_size(limit))
        .add_service(ViewServiceServer::new(view).max_decoding_message_size(limit))
        .add_service(RolloutServiceServer::new(rollout).max_decoding_message_size(limit))
        .add_service(KinematicsServiceServer::new(kinematics).max_decoding_message_size(limit));
    let entrance = Entrance { handle: handle.clone(), transport };
    routes.into_axum_router().route_layer(middleware::from_fn_with_state(entrance, calls::pass)).into()
}

/// A robot in one published state.
struct PublishedRobot {
    state: Arc<Published>,
    /// Index of the robot in the state.
    index: usize,
    layout: Arc<EntityLayout>,
    /// Status of each joint of the model, in its order.
    joints: Vec<JointStatus>,
}

/// Returns a robot in the newest published state.
fn joints_of(handle: &SimHandle, robot: &str) -> Result<PublishedRobot, CallError> {
    let state = handle.newest();
    let (index, layout) = entity::find(&state, robot)?;
    let layout = Arc::clone(layout);
    let joints = state.state.joint_status(index).unwrap_or_default();
    Ok(PublishedRobot { state, index, layout, joints })
}

/// Returns the error for a command that got another command's answer.
fn mismatched<T>(what: &T) -> CallError
where
    T: std::fmt::Debug,
{
    CallError::Internal { message: format!("this is not an answer: {what:?}") }
}
