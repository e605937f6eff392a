//! The services of `simulation_interfaces`: each makes a call of the handle, like any client.

use std::sync::Arc;

use bytes::Bytes;
use glamx::{DPose3, DQuat, DVec3};
use simd_core::simulation::command::ResetScope;
use simd_core::{Command, Error as WorldError};
use simd_ros2::messages::geometry_msgs::{Accel, Pose, Twist, Vector3};
use simd_ros2::messages::simulation_interfaces::*;
use simd_ros2::messages::std_msgs::Header;
use simd_ros2::wire::Attachment;
use simd_ros2::{Message, Service};
use zenoh::Wait as _;
use zenoh::bytes::Encoding;
use zenoh::query::Query;

use super::calls::Calls;
use super::endpoints::{Graph, Server, wall_time};
use super::robots::{WORLD, pose_message};
use simd_world::SimHandle;
use simd_world::handle::{CallError, RunState, Source, SpawnRequest};
use simd_world::recording::stamp;

/// Outcome of a call: [`Result`] under another name, since it hides Rust's.
type Outcome = Result;
/// Answer of a call, or the reason for its refusal.
type Answer<T> = std::result::Result<T, Outcome>;

/// Supported features of `simulation_interfaces`.
const FEATURES: [u8; 13] = [
    SimulatorFeatures::SPAWNING,
    SimulatorFeatures::DELETING,
    SimulatorFeatures::SPAWNING_RESOURCE_STRING,
    SimulatorFeatures::ENTITY_STATE_GETTING,
    SimulatorFeatures::ENTITY_STATE_SETTING,
    SimulatorFeatures::SIMULATION_RESET,
    SimulatorFeatures::SIMULATION_RESET_TIME,
    SimulatorFeatures::SIMULATION_RESET_STATE,
    SimulatorFeatures::SIMULATION_RESET_SPAWNED,
    SimulatorFeatures::SIMULATION_STATE_GETTING,
    SimulatorFeatures::SIMULATION_STATE_SETTING,
    SimulatorFeatures::SIMULATION_STATE_PAUSE,
    SimulatorFeatures::STEP_SIMULATION_MULTIPLE,
];

/// Serves all services until the returned servers are dropped.
///
/// # Errors
/// Returns an error if one cannot be declared.
pub(super) async fn serve(
    graph: &Arc<Graph>,
    handle: &SimHandle,
) -> std::result::Result<Vec<Server>, zenoh::Error> {
    macro_rules! served {
        ($($service:ty, $name:literal, $function:path;)*) => {
            vec![$(one::<$service, _, _>(graph, graph.calls(), handle, &graph.name($name), $function).await?),*]
        };
    }
    Ok(served! {
        GetSimulatorFeatures, "get_simulator_features", get_simulator_features;
        GetEntities, "get_entities", get_entities;
        GetEntityState, "get_entity_state", get_entity_state;
        SetEntityState, "set_entity_state", set_entity_state;
        SpawnEntity, "spawn_entity", spawn_entity;
        DeleteEntity, "delete_entity", delete_entity;
        GetSimulationState, "get_simulation_state", get_simulation_state;
        SetSimulationState, "set_simulation_state", set_simulation_state;
        ResetSimulation, "reset_simulation", reset_simulation;
        StepSimulation, "step_simulation", step_simulation;
    })
}

/// Serves one service by its full name: decodes the request, and sends the response of `answer`.
pub(super) async fn one<S, A, F>(
    graph: &Graph,
    calls: &Arc<Calls>,
    handle: &SimHandle,
    name: &str,
    answer: A,
) -> std::result::Result<Server, zenoh::Error>
where
    S: Service + 'static,
    S::Request: Send + 'static,
    S::Response: Send + 'static,
    A: Fn(SimHandle, S::Request) -> F + Clone + Send + Sync + 'static,
    F: Future<Output = S::Response> + Send + 'static,
{
    let (calls, handle) = (Arc::clone(calls), handle.clone());
    let take = move |query: Query| {
        let (handle, answer) = (handle.clone(), answer.clone());
        calls.serve(move || async move {
            let payload = query.payload().map(|payload| payload.to_bytes().into_owned()).unwrap_or_default();
            let request = match S::Request::from_cdr(&payload) {
                Ok(request) => request,
                Err(error) => {
                    // A reply of the service's type cannot express this.
                    tracing::warn!("a call of ROS 2 is refused: {error}");
                    return None;
                }
            };
            let response = answer(handle, request).await.to_cdr();
            Some(move || reply(&query, response))
        });
    };
    graph.server::<S>(name, take).await
}

/// Sends a response with the number and the name of the request, by which its client recognizes it.
fn reply(query: &Query, response: Vec<u8>) {
    let asked = query.attachment().and_then(|bytes| Attachment::parse(&bytes.to_bytes()));
    let asked = asked.unwrap_or(Attachment { sequence: 0, source_time: 0, gid: [0; 16] });
    let attachment = Attachment { source_time: wall_time(), ..asked }.bytes();
    let reply = query.reply(query.key_expr(), response).encoding(Encoding::from("application/cdr"));
    if let Err(error) = reply.attachment(attachment).wait() {
        tracing::debug!("a reply of ROS 2 is not sent: {error}");
    }
}

fn ok() -> Outcome {
    Outcome { result: Outcome::RESULT_OK, error_message: String::new() }
}

fn refused(result: u8, message: impl Into<String>) -> Outcome {
    Outcome { result, error_message: message.into() }
}

fn outcome<T>(answer: Answer<T>) -> Outcome {
    answer.map_or_else(|refused| refused, |_done| ok())
}

fn failed(error: CallError) -> Outcome {
    let result = match &error {
        CallError::World(WorldError::RobotNotFound { .. }) => Outcome::RESULT_NOT_FOUND,
        CallError::WrongState { .. } => Outcome::RESULT_INCORRECT_STATE,
        _ => Outcome::RESULT_OPERATION_FAILED,
    };
    refused(result, error.to_string())
}

async fn get_simulator_features(
    _: SimHandle,
    _: GetSimulatorFeaturesRequest,
) -> GetSimulatorFeaturesResponse {
    GetSimulatorFeaturesResponse {
        features: SimulatorFeatures {
            features: FEATURES.iter().map(|feature| u16::from(*feature)).collect(),
            spawn_formats: vec!["urdf".to_owned()],
            custom_info: format!("simd {}", env!("CARGO_PKG_VERSION")),
        },
    }
}

async fn get_entities(handle: SimHandle, request: GetEntitiesRequest) -> GetEntitiesResponse {
    let entities = selected(&handle, &request.filters);
    GetEntitiesResponse {
        result: entities.as_ref().map_or_else(Clone::clone, |_| ok()),
        entities: entities.unwrap_or_default(),
    }
}

/// Returns the selected robots. Regular expressions may only name a part of a name, its beginning or its end.
fn selected(handle: &SimHandle, filters: &EntityFilters) -> Answer<Vec<String>> {
    let unsupported = |what: &str| Err(refused(Outcome::RESULT_FEATURE_UNSUPPORTED, what));
    if !filters.categories.is_empty() || !filters.tags.tags.is_empty() {
        return unsupported("categories and tags are not supported");
    }
    if filters.bounds.r#type != Bounds::TYPE_EMPTY {
        return unsupported("a search by bounds is not supported");
    }
    let rest = filters.filter.strip_prefix('^');
    let (at_start, text) = (rest.is_some(), rest.unwrap_or(&filters.filter));
    let rest = text.strip_suffix('$');
    let (at_end, text) = (rest.is_some(), rest.unwrap_or(text));
    if !text.bytes().all(|byte| byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'-')) {
        return unsupported(
            "filters.filter may have letters, digits, _ and -, with ^ before and $ after them",
        );
    }
    let matches = |name: &str| match (at_start, at_end) {
        (true, true) => name == text,
        (true, false) => name.starts_with(text),
        (false, true) => name.ends_with(text),
        (false, false) => name.contains(text),
    };
    let newest = handle.newest();
    let names = newest.state.world.entities.iter().map(|entity| &entity.name);
    Ok(names.filter(|name| matches(name)).cloned().collect())
}

async fn get_entity_state(handle: SimHandle, request: GetEntityStateRequest) -> GetEntityStateResponse {
    let newest = handle.newest();
    let state = &newest.state;
    let Some(root) = state.entity(&request.entity).and_then(|(index, _)| state.roots.get(index)) else {
        let known = state.world.entities.iter().map(|entity| entity.name.clone()).collect();
        let error = WorldError::RobotNotFound { robot: request.entity, known };
        return GetEntityStateResponse { result: failed(error.into()), state: EntityState::default() };
    };
    let vector = |v: DVec3| Vector3 { x: v.x, y: v.y, z: v.z };
    let state = EntityState {
        header: Header { stamp: stamp(state.at.sim_time), frame_id: WORLD.to_owned() },
        pose: pose_message(root.pose),
        twist: Twist { linear: vector(root.linear), angular: vector(root.angular) },
        acceleration: Accel::default(),
    };
    GetEntityStateResponse { result: ok(), state }
}

async fn set_entity_state(handle: SimHandle, request: SetEntityStateRequest) -> SetEntityStateResponse {
    SetEntityStateResponse { result: outcome(set_state(handle, request).await) }
}

async fn set_state(handle: SimHandle, request: SetEntityStateRequest) -> Answer<()> {
    let SetEntityStateRequest { entity, state, set_pose, set_twist, set_acceleration } = request;
    check_frame(&state.header)?;
    if set_acceleration {
        return Err(refused(
            Outcome::RESULT_FEATURE_UNSUPPORTED,
            "an acceleration cannot be set: it follows from forces",
        ));
    }
    let pose = match set_pose {
        true => Some(
            pose(&state.pose).map_err(|sentence| refused(SetEntityStateResponse::INVALID_POSE, sentence))?,
        ),
        false => None,
    };
    let vector = |v: &Vector3| DVec3::new(v.x, v.y, v.z);
    let twist = set_twist.then(|| (vector(&state.twist.linear), vector(&state.twist.angular)));
    let command = Command::SetEntityState { robot: entity, pose, twist };
    handle.command(command).await.map(drop).map_err(failed)
}

fn check_frame(header: &Header) -> Answer<()> {
    match header.frame_id.as_str() {
        "" | WORLD => Ok(()),
        other => Err(refused(
            Outcome::RESULT_FEATURE_UNSUPPORTED,
            format!("header.frame_id is {other:?}; it must be {WORLD:?}, or empty"),
        )),
    }
}

/// Converts a pose. All zeros, the default of a message, is not a rotation.
fn pose(pose: &Pose) -> std::result::Result<DPose3, String> {
    let (at, turned) = (&pose.position, &pose.orientation);
    let rotation = DQuat::from_xyzw(turned.x, turned.y, turned.z, turned.w);
    let length = rotation.length();
    let rotation = if length == 0.0 { DQuat::IDENTITY } else { rotation / length };
    let pose = DPose3::from_parts(DVec3::new(at.x, at.y, at.z), rotation);
    if !pose.translation.is_finite()
        || !rotation.is_finite()
        || (length != 0.0 && (length - 1.0).abs() > 0.01)
    {
        return Err("the pose must have finite numbers, and a quaternion of length 1".to_owned());
    }
    Ok(pose)
}

async fn spawn_entity(handle: SimHandle, request: SpawnEntityRequest) -> SpawnEntityResponse {
    match spawn(handle, request).await {
        Ok(entity_name) => SpawnEntityResponse { result: ok(), entity_name },
        Err(result) => SpawnEntityResponse { result, entity_name: String::new() },
    }
}

async fn spawn(handle: SimHandle, request: SpawnEntityRequest) -> Answer<String> {
    let SpawnEntityRequest { name, allow_renaming, entity_resource, entity_namespace: _, initial_pose } =
        request;
    check_frame(&initial_pose.header)?;
    let pose =
        pose(&initial_pose.pose).map_err(|sentence| refused(SpawnEntityResponse::INVALID_POSE, sentence))?;
    let Resource { uri, resource_string } = entity_resource;
    let source = match (uri.is_empty(), resource_string.is_empty()) {
        (true, true) => {
            return Err(refused(SpawnEntityResponse::NO_RESOURCE, "uri and resource_string are empty"));
        }
        (true, false) => Source::Inline {
            urdf: Bytes::from(resource_string),
            assets: Default::default(),
            missing: Default::default(),
        },
        // Below an asset root, which the loader ensures.
        (false, _) => Source::Path(uri.strip_prefix("file://").unwrap_or(&uri).to_owned()),
    };
    let request = SpawnRequest {
        source,
        name,
        allow_renaming,
        pose,
        free_place: Default::default(),
        fixed_base: None,
        passive: false,
        joint_positions: Vec::new(),
        joint_orientations: Vec::new(),
        scale: 1.0,
        strict: false,
        mesh_shapes: Default::default(),
        contact_settings: Default::default(),
        srdf: Bytes::new(),
        collision_pairs: Vec::new(),
        model: String::new(),
    };
    let loaded = handle.spawn(request).await.map_err(|error| {
        let result = match &error {
            CallError::World(WorldError::RobotExists { .. }) => SpawnEntityResponse::NAME_NOT_UNIQUE,
            CallError::InvalidDescription { .. } => SpawnEntityResponse::RESOURCE_PARSE_ERROR,
            _ => Outcome::RESULT_OPERATION_FAILED,
        };
        refused(result, error.to_string())
    })?;
    Ok(loaded.name)
}

async fn delete_entity(handle: SimHandle, request: DeleteEntityRequest) -> DeleteEntityResponse {
    let done = handle.command(Command::Delete { robot: request.entity }).await;
    DeleteEntityResponse { result: outcome(done.map_err(failed)) }
}

async fn get_simulation_state(handle: SimHandle, _: GetSimulationStateRequest) -> GetSimulationStateResponse {
    let state = state_number(handle.newest().statistics.state);
    GetSimulationStateResponse { state: SimulationState { state }, result: ok() }
}

fn state_number(state: RunState) -> u8 {
    match state {
        RunState::Stopped => SimulationState::STATE_STOPPED,
        RunState::Playing => SimulationState::STATE_PLAYING,
        RunState::Paused => SimulationState::STATE_PAUSED,
    }
}

async fn set_simulation_state(
    handle: SimHandle,
    request: SetSimulationStateRequest,
) -> SetSimulationStateResponse {
    let wanted = request.state.state;
    let result = match wanted {
        _ if wanted == state_number(handle.newest().statistics.state) => refused(
            SetSimulationStateResponse::ALREADY_IN_TARGET_STATE,
            "the simulation is already in that state",
        ),
        SimulationState::STATE_STOPPED => outcome(handle.set_state(RunState::Stopped).await.map_err(failed)),
        SimulationState::STATE_PLAYING => outcome(handle.set_state(RunState::Playing).await.map_err(failed)),
        SimulationState::STATE_PAUSED => outcome(handle.set_state(RunState::Paused).await.map_err(failed)),
        _ => refused(
            Outcome::RESULT_FEATURE_UNSUPPORTED,
            format!("state.state is {wanted}; it must be 0 (stopped), 1 (playing) or 2 (paused)"),
        ),
    };
    SetSimulationStateResponse { result }
}

async fn reset_simulation(handle: SimHandle, request: ResetSimulationRequest) -> ResetSimulationResponse {
    let scope = match request.scope {
        ResetSimulationRequest::SCOPE_DEFAULT => ResetSimulationRequest::SCOPE_ALL,
        scope => scope,
    };
    let has = |part| scope & part != 0;
    let scope = ResetScope {
        time: has(ResetSimulationRequest::SCOPE_TIME),
        state: has(ResetSimulationRequest::SCOPE_STATE),
        spawned: has(ResetSimulationRequest::SCOPE_SPAWNED),
    };
    let done = handle.command(Command::Reset(scope)).await;
    ResetSimulationResponse { result: outcome(done.map_err(failed)) }
}

async fn step_simulation(handle: SimHandle, request: StepSimulationRequest) -> StepSimulationResponse {
    // The request needs a paused simulation; while it plays, the operation fails, as the service defines.
    let result = match handle.step(request.steps).await {
        Ok(_) => ok(),
        Err(error) => refused(Outcome::RESULT_OPERATION_FAILED, error.to_string()),
    };
    StepSimulationResponse { result }
}
