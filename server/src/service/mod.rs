//! The services of `simd.v1`, once for every transport: a request is parsed by `convert`, done by
//! [`SimHandle`], and answered by `convert`.
//!
//! * [`simulation`], [`entity`], [`joint`], [`event`], [`parameter`], [`kinematics`], [`contact`],
//!   [`client`]: one file a service.
//! * [`callers`]: who calls.
//! * [`control`]: the stream that controllers use.
//! * `spawning`: the stream of those who wait for a robot.
//! * [`status`]: why a call is refused.
//! * [`transport`]: reasons for what tonic itself refuses.
//! * [`version`]: which clients are served.

pub mod callers;
pub mod client;
pub mod contact;
pub mod control;
pub mod entity;
pub mod event;
pub mod joint;
pub mod kinematics;
pub mod parameter;
pub mod simulation;
mod spawning;
pub mod status;
pub mod transport;
pub mod version;

use std::pin::Pin;
use std::sync::Arc;

use simd_core::simulation::query::JointStatus;
use simd_core::simulation::snapshot::EntityLayout;
use simd_core::{Answer, Command, Error, Query};
use simd_proto::v1::client_service_server::ClientServiceServer;
use simd_proto::v1::contact_service_server::ContactServiceServer;
use simd_proto::v1::entity_service_server::EntityServiceServer;
use simd_proto::v1::event_service_server::EventServiceServer;
use simd_proto::v1::joint_service_server::JointServiceServer;
use simd_proto::v1::kinematics_service_server::KinematicsServiceServer;
use simd_proto::v1::parameter_service_server::ParameterServiceServer;
use simd_proto::v1::simulation_service_server::SimulationServiceServer;
use tokio_stream::Stream;
use tonic::Status;
use tonic::service::Routes;

use self::callers::Noted;
use self::transport::Reasoned;
use self::version::Versioned;
use crate::SimHandle;
use crate::handle::{CallError, Done, Published, Transport};

/// How often a layout is asked for again where a reload comes between question and answer.
const LAYOUT_ATTEMPTS: usize = 3;

/// The answers of a stream.
pub(crate) type BoxStream<T> = Pin<Box<dyn Stream<Item = Result<T, Status>> + Send>>;

/// All services. Each front-end serves these to calls that come its way, and has no call of its own.
pub fn routes(handle: &SimHandle, transport: Transport) -> Routes {
    let limit = usize::try_from(handle.info().limits.message_bytes).unwrap_or(usize::MAX);
    let checked = Checked { handle, transport };
    let simulation = simulation::Service::new(handle.clone());
    let client = client::Service::new(handle.clone());
    let contact = contact::Service::new(handle.clone());
    let entity = entity::Service::new(handle.clone());
    let joint = joint::Service::new(handle.clone());
    let event = event::Service::new(handle.clone());
    let parameter = parameter::Service::new(handle.clone());
    let kinematics = kinematics::Service::new(handle.clone());
    Routes::default()
        .add_service(
            checked.service(SimulationServiceServer::new(simulation).max_decoding_message_size(limit)),
        )
        .add_service(checked.service(ClientServiceServer::new(client).max_decoding_message_size(limit)))
        .add_service(checked.service(ContactServiceServer::new(contact).max_decoding_message_size(limit)))
        .add_service(checked.service(EntityServiceServer::new(entity).max_decoding_message_size(limit)))
        .add_service(checked.service(JointServiceServer::new(joint).max_decoding_message_size(limit)))
        .add_service(checked.service(EventServiceServer::new(event).max_decoding_message_size(limit)))
        .add_service(checked.service(ParameterServiceServer::new(parameter).max_decoding_message_size(limit)))
        .add_service(
            checked.service(KinematicsServiceServer::new(kinematics).max_decoding_message_size(limit)),
        )
}

/// What each service is wrapped in.
struct Checked<'h> {
    handle: &'h SimHandle,
    transport: Transport,
}

impl Checked<'_> {
    /// For clients of a fitting version, which are noted, and with a reason for each refusal.
    fn service<S>(&self, service: S) -> Versioned<Reasoned<Noted<S>>> {
        Versioned(Reasoned(Noted { service, handle: self.handle.clone(), transport: self.transport }))
    }
}

/// Does a command once for each request id.
async fn command_once(handle: &SimHandle, request_id: &str, command: Command) -> Result<Done, CallError> {
    let doer = handle.clone();
    handle.once(request_id, async move { doer.command(command).await }).await
}

/// A robot in the newest state, with its place there and what holds for its joints:
/// settings come from the world, places from the state. Both are of one layout, or the
/// indices would be another robot's.
async fn joints_of(
    handle: &SimHandle,
    robot: &str,
) -> Result<(Arc<Published>, usize, Arc<EntityLayout>, Vec<JointStatus>), CallError> {
    let mut changed = Error::RobotNotFound { robot: robot.to_owned(), known: Vec::new() };
    for _attempt in 0..LAYOUT_ATTEMPTS {
        let answer = handle.query(Query::Joints { robot: robot.to_owned() }).await?;
        let Answer::Joints { layout_version, joints } = answer else {
            return Err(mismatched(&answer));
        };
        let state = handle.newest();
        let found = state.snapshot.entity(robot).map(|(place, entity)| (place, Arc::clone(entity)));
        match found {
            Some((place, entity)) if entity.version == layout_version => {
                return Ok((state, place, entity, joints));
            }
            Some((_place, entity)) => {
                changed = Error::LayoutChanged {
                    robot: robot.to_owned(),
                    requested: layout_version,
                    present: entity.version,
                };
            }
            None => {}
        }
    }
    Err(changed.into())
}

/// A question was answered with the answer to another one.
fn mismatched<T>(what: &T) -> CallError
where
    T: std::fmt::Debug,
{
    CallError::Internal { message: format!("this is no answer: {what:?}") }
}
