//! Answers of the constraint service.

use glamx::DVec3;
use simd_core::PublishedState;
use simd_core::simulation::published_state::{
    ConstraintDefinition, ConstraintEnd, ConstraintKind, ConstraintState,
};
use simd_proto::v1;

use super::geometry::{pose, vector};

/// Converts constraints of a published state: all, or those on the robot at an index.
pub fn constraints(state: &PublishedState, only: Option<usize>) -> Vec<v1::Constraint> {
    let all = state.constraints.iter().zip(&state.constraint_states);
    let wanted = all.filter(|(of, _)| only.is_none_or(|only| of.robots().any(|robot| robot == only)));
    wanted.map(|(definition, reading)| constraint(state, definition, reading)).collect()
}

fn constraint(
    state: &PublishedState,
    definition: &ConstraintDefinition,
    reading: &ConstraintState,
) -> v1::Constraint {
    let ConstraintDefinition { name, ends, kind, max_force, max_torque, breaks, disable_collisions } =
        definition;
    let ConstraintState {
        force,
        torque,
        last: _,
        point,
        position_error,
        angle_error,
        velocity_residual,
        angular_residual,
        is_saturated,
    } = *reading;
    let limit = |value: f64| value.is_finite().then_some(value);
    let is_gear = matches!(kind, ConstraintKind::Gear { .. });
    let [parent, child] = ends.map(|given| Some(end(state, &given, is_gear)));
    let (kind, axis) = match kind {
        ConstraintKind::Weld => (v1::ConstraintKind::Weld, None),
        ConstraintKind::PointToPoint => (v1::ConstraintKind::PointToPoint, None),
        ConstraintKind::Hinge { axis } => (v1::ConstraintKind::Hinge, Some(*axis)),
        ConstraintKind::Slide { axis } => (v1::ConstraintKind::Slide, Some(*axis)),
        ConstraintKind::Gear { .. } => (v1::ConstraintKind::Gear, None::<DVec3>),
        ConstraintKind::Distance { .. } => (v1::ConstraintKind::Distance, None),
    };
    let mut answer = v1::Constraint {
        name: name.clone(),
        kind: kind.into(),
        parent,
        child,
        axis: axis.map(vector),
        max_force: limit(*max_force),
        max_torque: limit(*max_torque),
        breaks: *breaks,
        disable_collisions: *disable_collisions,
        force: Some(vector(force)),
        torque: Some(vector(torque)),
        point: Some(vector(point)),
        position_error,
        angle_error,
        velocity_residual,
        angular_residual,
        saturated: is_saturated,
        ..v1::Constraint::default()
    };
    match definition.kind {
        ConstraintKind::Gear { ratio, offset } => {
            (answer.ratio, answer.offset) = (Some(ratio), Some(offset));
        }
        ConstraintKind::Distance { length, is_rope } => {
            (answer.length, answer.rope) = (Some(length), is_rope);
        }
        _ => {}
    }
    answer
}

fn end(
    state: &PublishedState,
    &ConstraintEnd { link, frame }: &ConstraintEnd,
    is_gear: bool,
) -> v1::ConstraintEnd {
    let pose = Some(pose(frame));
    let Some((robot, link)) = link else { return v1::ConstraintEnd { pose, ..Default::default() } };
    let Some(entity) = state.world.entities.get(robot) else { return v1::ConstraintEnd::default() };
    // Joint i moves link i + 1.
    let joint = link.checked_sub(1).filter(|_| is_gear).and_then(|joint| entity.model.joints.get(joint));
    v1::ConstraintEnd {
        robot: entity.name.clone(),
        link: entity.model.links.get(link).map(|link| link.name.clone()).unwrap_or_default(),
        joint: joint.map(|joint| joint.name.clone()).unwrap_or_default(),
        pose,
    }
}
