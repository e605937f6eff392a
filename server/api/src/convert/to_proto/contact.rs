//! Answers of the contact service, and surfaces of links.

use simd_core::PublishedState;
use simd_core::collision::{Groups, Surface};
use simd_core::dynamics::link_damping::LinkDamping;
use simd_core::simulation::published_state::ContactReport;
use simd_core::simulation::rays::RayReport;
use simd_proto::v1;

use super::geometry::vector;
use super::stamp;
use simd_world::handle::Published;

/// Converts the contact points of a published state that `is_wanted` accepts by the indices of the two
/// robots.
pub fn contacts(state: &PublishedState, is_wanted: impl Fn([usize; 2]) -> bool) -> Vec<v1::Contact> {
    let wanted = state.contacts.iter().filter(|contact| is_wanted(contact.robots));
    wanted.map(|report| contact(state, report)).collect()
}

/// Returns all contact points of a state, as a recording stores them.
pub fn recorded(state: &Published) -> v1::GetContactsResponse {
    v1::GetContactsResponse {
        contacts: contacts(&state.state, |_| true),
        stamp: Some(stamp::published(state)),
    }
}

fn contact(state: &PublishedState, report: &ContactReport) -> v1::Contact {
    let ContactReport { robots, links, point, normal, depth, normal_force, friction_force, last_force: _ } =
        *report;
    let names = |side: usize| {
        let entity = state.world.entities.get(robots[side])?;
        Some((entity.name.clone(), entity.model.links.get(links[side])?.name.clone()))
    };
    let ((robot_a, link_a), (robot_b, link_b)) = (names(0).unwrap_or_default(), names(1).unwrap_or_default());
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

/// Converts the hit of a ray, if any.
pub fn hit(report: Option<RayReport>) -> v1::RayHit {
    let Some(RayReport { robot, link, point, normal, fraction }) = report else {
        return v1::RayHit::default();
    };
    v1::RayHit { hit: true, robot, link, fraction, point: Some(vector(point)), normal: Some(vector(normal)) }
}

/// Converts a link's surface and groups; a link that cannot collide has no numbers.
pub fn link_properties(
    link: &str,
    surface: Option<Surface>,
    groups: Groups,
    damping: LinkDamping,
) -> v1::LinkProperties {
    v1::LinkProperties {
        link: link.to_owned(),
        friction: surface.map(|surface| surface.friction),
        restitution: surface.map(|surface| surface.restitution),
        collision_group: surface.map(|_| groups.group),
        collision_mask: surface.map(|_| groups.mask),
        rolling_friction: surface.map(|surface| surface.rolling_friction),
        spinning_friction: surface.map(|surface| surface.spinning_friction),
        contact_stiffness: surface.map(|surface| surface.stiffness),
        contact_damping: surface.map(|surface| surface.damping),
        linear_damping: Some(damping.linear),
        angular_damping: Some(damping.angular),
    }
}

/// Converts a robot's collision filter: pairs within the robot first, then pairs with other robots.
pub fn collision_filter(state: &PublishedState, robot_index: usize) -> v1::GetCollisionFilterResponse {
    let link = |robot: usize, link: usize| {
        let entity = state.world.entities.get(robot)?;
        Some(entity.model.links.get(link)?.name.clone())
    };
    let collision = |enabled| match enabled {
        true => v1::PairCollision::Enabled,
        false => v1::PairCollision::Disabled,
    };
    let settings = state.settings.get(robot_index);
    let own = settings.into_iter().flat_map(|settings| &*settings.collision_pairs).filter_map(|pair| {
        Some(v1::CollisionPair {
            link: link(robot_index, pair.links[0])?,
            other_robot: String::new(),
            other_link: link(robot_index, pair.links[1])?,
            collision: collision(pair.enabled).into(),
        })
    });
    let others = state.collision_pairs.iter().filter_map(|of| {
        let side = of.robots.iter().position(|robot| *robot == robot_index)?;
        let other = of.robots[1 - side];
        Some(v1::CollisionPair {
            link: link(robot_index, of.pair.links[side])?,
            other_robot: state.world.entities.get(other)?.name.clone(),
            other_link: link(other, of.pair.links[1 - side])?,
            collision: collision(of.pair.enabled).into(),
        })
    });
    v1::GetCollisionFilterResponse {
        self_collision: settings.is_some_and(|settings| settings.self_collision),
        pairs: own.chain(others).collect(),
        stamp: None,
    }
}
