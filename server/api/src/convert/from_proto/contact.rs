//! Requests of the contact service, and surfaces of links.

use glamx::DVec3;
use simd_core::simulation::command::LinkProperties;
use simd_model::robot::Material;
use simd_proto::v1;

use super::geometry::vector;
use crate::convert::field::{BadField, Path};

/// Returns the robot whose contacts are requested, or `None` for all robots.
pub fn contacts(request: v1::GetContactsRequest) -> Result<Option<String>, BadField> {
    let robot = Path::ROOT.field("robot").short(request.robot)?;
    Ok((!robot.is_empty()).then_some(robot))
}

/// Parses line segments between two points, world axes.
pub fn rays(rays: Vec<v1::Ray>) -> Result<Vec<[DVec3; 2]>, BadField> {
    let ray = |(index, ray): (usize, v1::Ray)| {
        let at = Path::ROOT.item("rays", index);
        let (from, to) = (at.field("from"), at.field("to"));
        Ok([vector(from.given(ray.from)?), vector(to.given(ray.to)?)])
    };
    rays.into_iter().enumerate().map(ray).collect()
}

/// Parses new surfaces of links; an empty name means all links.
pub fn link_properties(
    at: &Path<'_>,
    list: &str,
    given: Vec<v1::LinkProperties>,
) -> Result<Vec<LinkProperties>, BadField> {
    let read = |(index, given): (usize, v1::LinkProperties)| {
        let at = at.item(list, index);
        let v1::LinkProperties {
            link,
            friction,
            restitution,
            collision_group,
            collision_mask,
            rolling_friction,
            spinning_friction,
            contact_stiffness,
            contact_damping,
            linear_damping,
            angular_damping,
        } = given;
        let material = Material {
            friction,
            restitution,
            rolling_friction,
            spinning_friction,
            contact_stiffness,
            contact_damping,
        };
        Ok(LinkProperties {
            link: at.field("link").short(link)?,
            material,
            collision_group,
            collision_mask,
            linear_damping,
            angular_damping,
        })
    };
    given.into_iter().enumerate().map(read).collect()
}
