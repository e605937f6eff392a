//! Shapes and ways that questions are about.

use glamx::{DPose3, DVec3};
use simd_model::robot::Geometry;
use simd_proto::v1;

use super::geometry;
use super::primitive;
use crate::convert::field::{BadField, Path};

/// A side of a distance.
pub enum Side {
    /// A robot or a link of it, by name.
    Body(v1::QueryBody),
    /// A shape of no robot, and where it is.
    Shape(Geometry, DPose3),
}

/// A shape of no robot, and where it is.
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

/// A way, which must be given.
pub fn translation(given: Option<v1::Vector3>) -> Result<DVec3, BadField> {
    Ok(geometry::vector(Path::ROOT.field("translation").given(given)?))
}

/// The two sides of a distance; the second may be all others.
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
        return Err(at.field("shape").refuse("given beside a robot", "one of the two"));
    }
    let (geometry, pose) = shape(at, given, pose)?;
    Ok(Side::Shape(geometry, pose))
}
