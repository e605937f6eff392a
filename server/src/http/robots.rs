//! Robots as JSON, for pages and tools that do not speak gRPC, and as URDF, for tools that draw it.

use std::collections::BTreeMap;
use std::sync::Arc;

use axum::Extension;
use axum::body::Body;
use axum::extract::{Path, State};
use axum::http::{Response, StatusCode, header};
use axum::response::IntoResponse;
use serde::Serialize;
use simd_core::PublishedState;
use simd_core::simulation::published_state::{EntityLayout, Mode};
use simd_model::robot::{Geometry, JointKind};

use super::{Page, caching, files, refused};
use simd_world::SimHandle;
use simd_world::handle::{CallContext, RunState};

/// Answer of `GET /robots`.
#[derive(Serialize)]
struct World {
    /// Name of the daemon.
    name: String,
    state: &'static str,
    step: u64,
    sim_time: f64,
    robots: Vec<Robot>,
}

#[derive(Serialize)]
struct Robot {
    name: String,
    joints: Vec<Joint>,
}

/// All values of a joint, with the units of the schema: radians or metres.
#[derive(Serialize)]
struct Joint {
    name: String,
    r#type: &'static str,
    position: Vec<f64>,
    velocity: Vec<f64>,
    effort: Vec<f64>,
    target: Vec<f64>,
    mode: Vec<&'static str>,
}

/// Returns all robots with their joints, in the newest state.
pub(super) async fn list(
    State(page): State<Arc<Page>>,
    Extension(call): Extension<CallContext>,
) -> Response<Body> {
    let handle = page.handle.of_call(call);
    let shown = handle.clone();
    let text = match handle.make_large(async move { serde_json::to_string(&world(&shown)) }).await {
        Ok(Ok(text)) => text,
        Err(error) => return refused(&error),
        Ok(Err(error)) => return (StatusCode::INTERNAL_SERVER_ERROR, format!("{error}\n")).into_response(),
    };
    let kind = [(header::CONTENT_TYPE, "application/json"), (header::CACHE_CONTROL, "no-store")];
    (kind, text).into_response()
}

fn world(handle: &SimHandle) -> World {
    let newest = handle.newest();
    let state = &newest.state;
    World {
        name: handle.info().name.clone(),
        state: match newest.statistics.state {
            RunState::Playing => "playing",
            RunState::Paused => "paused",
            RunState::Stopped => "stopped",
        },
        step: state.at.step,
        sim_time: state.at.sim_time,
        robots: state.world.entities.iter().map(|entity| robot(state, entity)).collect(),
    }
}

fn robot(state: &PublishedState, entity: &EntityLayout) -> Robot {
    let joints = entity.model.joints.iter().enumerate();
    let joints = joints.filter(|(_, joint)| joint.kind != JointKind::Fixed).map(|(index, joint)| {
        let own = entity.joint_velocities.get(index).cloned().unwrap_or_default();
        let first = entity.velocities.start;
        let indices = first + own.start..first + own.end;
        let values = |of: &[f64]| of.get(indices.clone()).unwrap_or_default().to_vec();
        let positions = entity.joint_positions.get(index).cloned().unwrap_or_default();
        let first = entity.positions.start;
        let positions = first + positions.start..first + positions.end;
        Joint {
            name: joint.name.clone(),
            r#type: kind(joint.kind),
            position: state.positions.get(positions).unwrap_or_default().to_vec(),
            velocity: values(&state.velocities),
            effort: values(&state.efforts),
            target: values(&state.targets),
            mode: state.modes.get(indices.clone()).unwrap_or_default().iter().copied().map(mode).collect(),
        }
    });
    Robot { name: entity.name.clone(), joints: joints.collect() }
}

fn kind(kind: JointKind) -> &'static str {
    match kind {
        JointKind::Revolute => "revolute",
        JointKind::Continuous => "continuous",
        JointKind::Prismatic => "prismatic",
        JointKind::Fixed => "fixed",
        JointKind::Floating => "floating",
        JointKind::Planar => "planar",
        JointKind::Spherical => "spherical",
    }
}

fn mode(mode: Mode) -> &'static str {
    match mode {
        Mode::None => "none",
        Mode::Passive => "passive",
        Mode::Position => "position",
        Mode::Velocity => "velocity",
        Mode::Effort => "effort",
        Mode::Hold => "hold",
    }
}

/// `GET /robots/NAME/robot.urdf`: the description, with this daemon's addresses of its meshes.
pub(super) async fn description(
    State(page): State<Arc<Page>>,
    Extension(call): Extension<CallContext>,
    Path(robot): Path<String>,
) -> Response<Body> {
    let newest = page.handle.newest();
    let Some((_, entity)) = newest.state.entity(&robot) else {
        let sentence = format!("there is no robot {robot:?} in this world; /robots lists them\n");
        return (StatusCode::NOT_FOUND, sentence).into_response();
    };
    let meshes = addresses(entity);
    let address = move |uri: &str| meshes.get(uri.trim()).cloned();
    match page.handle.of_call(call).description_with(&robot, address).await {
        Ok(Some(text)) => {
            let headers = [
                (header::CONTENT_TYPE, "application/xml; charset=utf-8"),
                (header::CACHE_CONTROL, caching::CHECKED),
                (header::CONTENT_SECURITY_POLICY, files::SANDBOX),
            ];
            (headers, text).into_response()
        }
        Ok(None) => {
            let sentence = "the description of this robot is no longer kept\n";
            (StatusCode::NOT_FOUND, sentence).into_response()
        }
        Err(error) => refused(&error),
    }
}

/// Returns the addresses of the meshes that were found, by their names in the description.
fn addresses(entity: &EntityLayout) -> BTreeMap<String, String> {
    let links = || entity.model.links.iter();
    let visuals = links().flat_map(|link| &link.visuals).map(|visual| &visual.geometry);
    let collisions = links().flat_map(|link| &link.collisions).map(|collision| &collision.geometry);
    let address = |geometry: &Geometry| match geometry {
        Geometry::Mesh { uri, asset: Some(asset), .. } => {
            let extension = uri.rsplit_once('.').map_or("", |(_, extension)| extension.trim());
            let is_plain = !extension.is_empty()
                && extension.len() < 10
                && extension.bytes().all(|byte| byte.is_ascii_alphanumeric());
            let ending =
                if is_plain { format!(".{}", extension.to_ascii_lowercase()) } else { String::new() };
            Some((uri.trim().to_owned(), format!("/assets/{}{ending}", asset.sha256)))
        }
        _ => None,
    };
    visuals.chain(collisions).filter_map(address).collect()
}
