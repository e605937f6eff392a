//! Answers of the entity service: robots, and reports about descriptions.

use simd_core::simulation::published_state::{EntityLayout, PublishedState, RootState};
use simd_model::robot::{JointKind, Link, Sha256};
use simd_model::setup::NamedState;
use simd_model::{Disposition, LoadReport, RobotModel, Severity};
use simd_proto::v1;

use super::geometry::{self, vector};
use super::simulation::count;
use simd_world::handle::{AssetState, Prepared, ValidatedRobot};
use simd_world::loading::{Phase, Progress};

/// Converts a robot in the world. `description` is the digest of its URDF.
pub fn entity_info(
    entity: &EntityLayout,
    root: Option<&RootState>,
    description: Option<Sha256>,
) -> v1::EntityInfo {
    let base = if entity.fixed_base { v1::Base::Fixed } else { v1::Base::Free };
    v1::EntityInfo {
        name: entity.name.clone(),
        layout_version: entity.version,
        base: base.into(),
        description: description.map(|digest| digest.to_string()).unwrap_or_default(),
        loaded_at_start: entity.loaded_at_start,
        disabled_reason: root.and_then(|root| root.disabled.as_deref()).unwrap_or_default().to_owned(),
        ..of_model(&entity.model)
    }
}

/// Converts a robot that is not in the world, with its own name and its own base.
pub fn described(robot: &ValidatedRobot) -> v1::EntityInfo {
    let ValidatedRobot { model, fixed, description } = robot;
    let base = if *fixed { v1::Base::Fixed } else { v1::Base::Free };
    v1::EntityInfo {
        name: simd_model::wire_name(&model.name),
        base: base.into(),
        description: description.to_string(),
        ..of_model(model)
    }
}

/// Converts the facts that the model has.
fn of_model(model: &RobotModel) -> v1::EntityInfo {
    let mut parents = vec![""; model.links.len()];
    for joint in &model.joints {
        if let (Some(slot), Some(parent)) = (parents.get_mut(joint.child), model.links.get(joint.parent)) {
            *slot = &parent.name;
        }
    }
    v1::EntityInfo {
        model: model.name.clone(),
        mass: model.links.iter().map(|link| link.inertial.mass).sum(),
        links: model.links.iter().zip(parents).map(|(link, parent)| link_info(link, parent)).collect(),
        joints: count(model.joints.len()),
        moving_joints: count(model.joints.iter().filter(|joint| joint.kind != JointKind::Fixed).count()),
        states: model.setup.states.iter().map(|state| named_state(state, model)).collect(),
        ..v1::EntityInfo::default()
    }
}

fn named_state(state: &NamedState, model: &RobotModel) -> v1::NamedState {
    let position =
        |(joint, position): &(usize, f64)| Some((model.joints.get(*joint)?.name.clone(), *position));
    v1::NamedState {
        name: state.name.clone(),
        group: state.group.clone(),
        positions: state.positions.iter().filter_map(position).collect(),
    }
}

fn link_info(link: &Link, parent: &str) -> v1::LinkInfo {
    let inertia = link.inertial.inertia;
    v1::LinkInfo {
        name: link.name.clone(),
        parent: parent.to_owned(),
        mass: link.inertial.mass,
        center_of_mass: Some(vector(link.inertial.center_of_mass)),
        inertia: vec![
            inertia.x_axis.x,
            inertia.y_axis.x,
            inertia.z_axis.x,
            inertia.y_axis.y,
            inertia.z_axis.y,
            inertia.z_axis.z,
        ],
    }
}

/// Converts world poses of a robot's links.
pub fn link_poses(state: &PublishedState, index: usize, entity: &EntityLayout) -> v1::RobotLinkPoses {
    let poses = state.link_poses(index).unwrap_or_default();
    v1::RobotLinkPoses {
        robot: entity.name.clone(),
        layout_version: entity.version,
        poses: poses.iter().flat_map(geometry::pose_values).collect(),
        unchanged: false,
    }
}

/// Returns the answer that replaces poses that the client already has.
pub fn unchanged_link_poses(entity: &EntityLayout) -> v1::RobotLinkPoses {
    v1::RobotLinkPoses {
        robot: entity.name.clone(),
        layout_version: entity.version,
        unchanged: true,
        ..Default::default()
    }
}

/// Converts the progress of a robot.
pub fn progress(progress: &Progress) -> v1::LoadProgress {
    let phase = match progress.phase {
        Phase::Waiting => v1::LoadPhase::Waiting,
        Phase::Reading => v1::LoadPhase::Reading,
        Phase::Hulls => v1::LoadPhase::Hulls,
        Phase::Spawning => v1::LoadPhase::Spawning,
    };
    v1::LoadProgress {
        phase: phase.into(),
        done: count(progress.done),
        total: count(progress.total),
        uri: progress.uri.clone(),
    }
}

/// Converts the report about a description.
pub fn report(report: LoadReport, summary: String) -> v1::LoadReport {
    let findings = report
        .findings
        .into_iter()
        .map(|finding| v1::Finding {
            severity: severity(finding.severity).into(),
            disposition: disposition(finding.disposition).into(),
            element: finding.element,
            line: finding.line.unwrap_or(0),
            message: finding.message,
            file: finding.file.unwrap_or_default(),
        })
        .collect();
    v1::LoadReport { summary, findings }
}

fn severity(severity: Severity) -> v1::Severity {
    match severity {
        Severity::Info => v1::Severity::Info,
        Severity::Warning => v1::Severity::Warning,
        Severity::Error => v1::Severity::Error,
    }
}

fn disposition(disposition: Disposition) -> v1::Disposition {
    match disposition {
        Disposition::Used => v1::Disposition::Used,
        Disposition::Defaulted => v1::Disposition::Defaulted,
        Disposition::Repaired => v1::Disposition::Repaired,
        Disposition::Ignored => v1::Disposition::Ignored,
        Disposition::Refused => v1::Disposition::Refused,
    }
}

/// Converts a stored description, and the files that it needs.
pub fn prepared(prepared: Prepared) -> v1::PrepareDescriptionResponse {
    let assets = prepared
        .assets
        .into_iter()
        .map(|(uri, state)| v1::AssetRequirement { uri, state: asset_state(state).into() })
        .collect();
    v1::PrepareDescriptionResponse {
        description: prepared.description.to_string(),
        name: prepared.name,
        assets,
        models: prepared.models,
    }
}

fn asset_state(state: AssetState) -> v1::AssetState {
    match state {
        AssetState::Unresolved => v1::AssetState::Unresolved,
        AssetState::Lacking => v1::AssetState::Lacking,
        AssetState::Present => v1::AssetState::Present,
    }
}
