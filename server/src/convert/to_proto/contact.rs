//! Answers of the contact service, and surfaces of links.

use simd_core::Snapshot;
use simd_core::collision::Surface;
use simd_core::simulation::query::{ContactReport, RayReport};
use simd_core::simulation::snapshot::ContactState;
use simd_proto::v1;

use super::geometry::vector;

/// A point of a snapshot where two links touch.
pub fn contact_state(snapshot: &Snapshot, state: &ContactState) -> v1::Contact {
    let name = |side: usize| {
        let entity = snapshot.world.entities.get(state.robots[side])?;
        Some((entity.name.clone(), entity.model.links.get(state.links[side])?.name.clone()))
    };
    let ((robot_a, link_a), (robot_b, link_b)) = (name(0).unwrap_or_default(), name(1).unwrap_or_default());
    v1::Contact {
        robot_a,
        link_a,
        robot_b,
        link_b,
        point: Some(vector(state.point)),
        normal: Some(vector(state.normal)),
        depth: state.depth,
        normal_force: state.normal_force,
        friction_force: Some(vector(state.friction_force)),
    }
}

/// A point where two links touch.
pub fn contact(report: ContactReport) -> v1::Contact {
    let ContactReport { robots, links, point, normal, depth, normal_force, friction_force } = report;
    let ([robot_a, robot_b], [link_a, link_b]) = (robots, links);
    v1::Contact {
        robot_a,
        link_a,
        robot_b,
        link_b,
        point: Some(vector(point)),
        normal: Some(vector(normal)),
        depth,
        normal_force,
        friction_force: Some(vector(friction_force)),
    }
}

/// What a ray met, if anything.
pub fn hit(report: Option<RayReport>) -> v1::RayHit {
    let Some(RayReport { robot, link, point, normal, fraction }) = report else {
        return v1::RayHit::default();
    };
    v1::RayHit { hit: true, robot, link, fraction, point: Some(vector(point)), normal: Some(vector(normal)) }
}

/// A link's surface; none where it touches nothing.
pub fn link_properties(link: &str, surface: Option<Surface>) -> v1::LinkProperties {
    v1::LinkProperties {
        link: link.to_owned(),
        friction: surface.map(|surface| surface.friction),
        restitution: surface.map(|surface| surface.restitution),
    }
}
