//! Answers of the kinematics service.

use glamx::DVec3;
use simd_core::PublishedState;
use simd_core::dynamics::inverse_kinematics::IkSolution;
use simd_core::dynamics::spatial::Spatial;
use simd_core::simulation::published_state::EntityLayout;
use simd_proto::v1;

use super::geometry::pose_values;
use super::simulation::count;

/// Converts poses and velocities of the links of the robot at an index of a published state.
pub fn link_states(state: &PublishedState, index: usize, entity: &EntityLayout) -> v1::RobotLinkStates {
    let poses = state.link_poses(index).unwrap_or_default();
    let twists = state.link_twists(index).unwrap_or_default();
    v1::RobotLinkStates {
        robot: entity.name.clone(),
        layout_version: entity.version,
        poses: poses.iter().flat_map(pose_values).collect(),
        twists: twists
            .iter()
            .flat_map(|(linear, angular)| [linear, angular])
            .flat_map(DVec3::to_array)
            .collect(),
    }
}

/// Converts columns, one for each velocity, to rows of numbers.
pub fn jacobian(columns: &[Spatial], stamp: v1::Stamp) -> v1::GetJacobianResponse {
    let rows = |part: fn(&Spatial) -> DVec3| {
        (0..3).flat_map(move |row| columns.iter().map(move |column| part(column)[row])).collect()
    };
    v1::GetJacobianResponse {
        linear: rows(|column| column.linear),
        angular: rows(|column| column.angular),
        columns: count(columns.len()),
        stamp: Some(stamp),
    }
}

/// Converts the best solution of a search.
pub fn found(found: IkSolution, stamp: v1::Stamp) -> v1::ComputeInverseKinematicsResponse {
    v1::ComputeInverseKinematicsResponse {
        positions: found.positions,
        converged: found.converged,
        position_error: found.position_error,
        orientation_error: found.orientation_error,
        iterations: found.iterations,
        stamp: Some(stamp),
    }
}
