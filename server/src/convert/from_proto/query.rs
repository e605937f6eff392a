//! Shapes and ways that questions are about.

use glamx::{DPose3, DVec3};
use simd_model::robot::Geometry;
use simd_proto::v1;

use super::geometry;
use super::primitive;
use crate::convert::field::{BadField, Path};

/// A shape of no robot, and where it is.
pub fn shape(shape: Option<v1::QueryShape>, pose: Option<v1::Pose>) -> Result<(Geometry, DPose3), BadField> {
    use v1::primitive::Geometry as Primitive;
    use v1::query_shape::Geometry as Wire;
    let at = Path::ROOT.field("shape");
    let shape = match at.field("geometry").given(at.given(shape)?.geometry)? {
        Wire::Box(shape) => Primitive::Box(shape),
        Wire::Sphere(shape) => Primitive::Sphere(shape),
        Wire::Cylinder(shape) => Primitive::Cylinder(shape),
        Wire::Capsule(shape) => Primitive::Capsule(shape),
    };
    let shape = primitive::geometry(&at, shape)?;
    let at = Path::ROOT.field("pose");
    Ok((shape, pose.map(|pose| geometry::pose(&at, pose)).transpose()?.unwrap_or(DPose3::IDENTITY)))
}

/// A way, which must be given.
pub fn translation(given: Option<v1::Vector3>) -> Result<DVec3, BadField> {
    Ok(geometry::vector(Path::ROOT.field("translation").given(given)?))
}

/// The two sides of a distance; the second may be all others.
pub fn sides(
    a: Option<v1::QueryBody>,
    b: Option<v1::QueryBody>,
) -> Result<(v1::QueryBody, Option<v1::QueryBody>), BadField> {
    let (at_a, at_b) = (Path::ROOT.field("a"), Path::ROOT.field("b"));
    let named = |at: &Path<'_>, body: v1::QueryBody| {
        let v1::QueryBody { robot, link, configuration } = body;
        let (robot, link) = (at.field("robot").name(robot)?, at.field("link").short(link)?);
        Ok::<_, BadField>(v1::QueryBody { robot, link, configuration })
    };
    Ok((named(&at_a, at_a.given(a)?)?, b.map(|b| named(&at_b, b)).transpose()?))
}
