//! Shapes and translations of queries.

use glamx::{DPose3, DVec3};
use simd_model::robot::Geometry;
use simd_proto::v1;

use super::geometry;
use super::primitive;
use crate::convert::field::{BadField, Path};

/// One side of a distance query.
pub enum Side {
    /// Robot or one of its links, by name.
    Body(v1::QueryBody),
    /// Shape that belongs to no robot, with its pose.
    Shape(Geometry, DPose3),
}

/// Parses a shape that belongs to no robot, with its pose.
pub fn shape(
    above: &Path<'_>,
    shape: Option<v1::QueryShape>,
    pose: Option<v1::Pose>,
) -> Result<(Geometry, DPose3), BadField> {
    use v1::primitive::Geometry as Primitive;
    use v1::query_shape::Geometry as Wire;
    let at = above.field("shape");
    let shape = match at.field("geometry").given(at.given(shape)?.geometry)? {
        Wire::Box(shape) => Primitive::Box(shape),
        Wire::Sphere(shape) => Primitive::Sphere(shape),
        Wire::Cylinder(shape) => Primitive::Cylinder(shape),
        Wire::Capsule(shape) => Primitive::Capsule(shape),
        Wire::Cone(shape) => Primitive::Cone(shape),
    };
    let shape = primitive::geometry(&at, shape)?;
    let at = above.field("pose");
    Ok((shape, pose.map(|pose| geometry::pose(&at, pose)).transpose()?.unwrap_or(DPose3::IDENTITY)))
}

/// Parses a translation, which must be given.
pub fn translation(given: Option<v1::Vector3>) -> Result<DVec3, BadField> {
    Ok(geometry::vector(Path::ROOT.field("translation").given(given)?))
}

/// Parses the two sides of a distance; an absent second side means all other robots.
pub fn sides(a: Option<v1::QueryBody>, b: Option<v1::QueryBody>) -> Result<(Side, Option<Side>), BadField> {
    let (at_a, at_b) = (Path::ROOT.field("a"), Path::ROOT.field("b"));
    Ok((side(&at_a, at_a.given(a)?)?, b.map(|b| side(&at_b, b)).transpose()?))
}

fn side(at: &Path<'_>, body: v1::QueryBody) -> Result<Side, BadField> {
    let v1::QueryBody { robot, link, configuration, shape: given, pose } = body;
    if given.is_none() {
        if pose.is_some() {
            return Err(at
                .field("pose")
                .refuse("given", "without a shape a robot is where it is, or in a configuration"));
        }
        let (robot, link) = (at.field("robot").name(robot)?, at.field("link").short(link)?);
        return Ok(Side::Body(v1::QueryBody { robot, link, configuration, shape: None, pose: None }));
    }
    if !robot.is_empty() || !link.is_empty() || configuration.is_some() {
        return Err(at.field("shape").refuse("given in addition to a robot", "one of the two"));
    }
    let (geometry, pose) = shape(at, given, pose)?;
    Ok(Side::Shape(geometry, pose))
}
