//! Shapes and their poses.

use glamx::{DPose3, DQuat, DVec3};
use roxmltree::Node;

use super::findings::{Findings, quoted};
use super::meshes::{Meshes, Use};
use super::numbers::{self, Shape};
use super::repair::{RepairedUrdf, given};
use crate::report::Disposition::{Defaulted, Ignored, Repaired};
use crate::robot::Geometry;

/// Returns the pose of an `<origin>`; the identity without one.
pub(super) fn pose(origin: &urdf_rs::Pose, node: Option<Node>, findings: &mut Findings) -> DPose3 {
    let translation = DVec3::from_array(origin.xyz.0);
    // urdf-rs converts to angles and loses a thousandth of a radian near the pole.
    let quaternion = node.filter(|node| given(Some(*node), "quat_xyzw"));
    if let Some((node, xyzw)) =
        quaternion.and_then(|node| Some((node, numbers::of::<4>(node, "quat_xyzw", Shape::Exactly(4))?)))
    {
        let given_rotation = DQuat::from_array(xyzw);
        if given(Some(node), "rpy") {
            findings.warn(node, Ignored, "rpy and quat_xyzw are both given: quat_xyzw is used");
        }
        let off = (given_rotation.length() - 1.0).abs();
        if given_rotation.length() > 1e-6 {
            if off > ROUNDING {
                findings.warn(node, Repaired, "quat_xyzw is not of length 1 and was normalized");
            }
            return DPose3::from_parts(translation, given_rotation.normalize());
        }
        findings.warn(node, Repaired, "quat_xyzw is 0: read as no rotation");
        return DPose3::from_parts(translation, DQuat::IDENTITY);
    }
    DPose3::from_parts(translation, rotation(origin.rpy.0))
}

/// Returns the rotation of roll, pitch and yaw about fixed axes: yaw after pitch after roll, as URDF defines
/// them.
pub(crate) fn rotation([roll, pitch, yaw]: [f64; 3]) -> DQuat {
    (DQuat::from_rotation_z(yaw) * DQuat::from_rotation_y(pitch) * DQuat::from_rotation_x(roll)).normalize()
}

/// Returns a shape of a visual or a collision; `None`, with a finding, if it has no extent.
pub(super) fn geometry<'a>(
    repaired: &RepairedUrdf<'a, '_>,
    shape: Node<'a, '_>,
    geometry: &urdf_rs::Geometry,
    meshes: &mut Meshes,
    usage: &Use,
    findings: &mut Findings,
) -> Option<Geometry> {
    let node = repaired.child(shape, "geometry").unwrap_or(shape);
    if let Some(plane) = repaired.child(node, "plane") {
        return Some(Geometry::Plane { normal: normal(plane, findings) });
    }
    let cone = repaired.child(node, "cone").and_then(cone);
    let read = match geometry {
        _ if cone.is_some() => cone?,
        urdf_rs::Geometry::Box { size } => Geometry::Box { size: DVec3::from_array(size.0) },
        urdf_rs::Geometry::Sphere { radius } => Geometry::Sphere { radius: *radius },
        urdf_rs::Geometry::Cylinder { radius, length } => {
            Geometry::Cylinder { radius: *radius, length: *length }
        }
        urdf_rs::Geometry::Capsule { radius, length } => {
            Geometry::Capsule { radius: *radius, length: *length }
        }
        urdf_rs::Geometry::Mesh { filename, scale } => {
            let node = repaired.child(node, "mesh").unwrap_or(node);
            let scale = scale.map_or(DVec3::ONE, |scale| DVec3::from_array(scale.0));
            if scale.to_array().contains(&0.0) {
                findings.warn(node, Ignored, format!("a scale of 0 leaves nothing of {}", quoted(filename)));
                return None;
            }
            let asset = meshes.get(filename, node, usage, findings);
            return Some(Geometry::Mesh { uri: filename.clone(), scale, asset });
        }
    };
    if has_extent(&read) {
        return Some(read);
    }
    findings.warn(node, Ignored, "a size is not above 0: the shape is ignored");
    None
}

/// Returns a cone. Its numbers were checked when the document was repaired.
fn cone(cone: Node) -> Option<Geometry> {
    let length_of = |name| numbers::of::<1>(cone, name, Shape::Exactly(1)).map(|[length]| length);
    Some(Geometry::Cone { radius: length_of("radius")?, length: length_of("length")? })
}

/// Returns the normal of a plane; PyBullet's default points up.
fn normal(plane: Node, findings: &mut Findings) -> DVec3 {
    let Some(read) = numbers::of::<3>(plane, "normal", Shape::Exactly(3)) else {
        findings.info(plane, Defaulted, "it has no normal; 0 0 1 is used");
        return DVec3::Z;
    };
    let read = DVec3::from_array(read);
    let length = read.length();
    if length < 1e-9 {
        findings.warn(plane, Repaired, "its normal is 0; 0 0 1 is used");
        return DVec3::Z;
    }
    if (length - 1.0).abs() > ROUNDING {
        findings.warn(plane, Repaired, format!("its normal has length {length:.6} and was normalized"));
    }
    read / length
}

/// Tolerance of the length of a unit vector: files have at least three digits.
pub(crate) const ROUNDING: f64 = 1e-3;

fn has_extent(geometry: &Geometry) -> bool {
    match geometry {
        Geometry::Box { size } => size.min_element() > 0.0,
        Geometry::Sphere { radius } => *radius > 0.0,
        Geometry::Cylinder { radius, length }
        | Geometry::Capsule { radius, length }
        | Geometry::Cone { radius, length } => *radius > 0.0 && *length > 0.0,
        Geometry::Plane { .. } | Geometry::Mesh { .. } => true,
    }
}
