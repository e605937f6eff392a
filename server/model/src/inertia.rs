//! Tensors of inertia: checks, and tensors of shapes with a density.

use glamx::{DMat3, DPose3, DQuat, DSymmetricEigen3, DVec3};
use parry3d_f64::mass_properties::MassProperties;

use crate::report::short;
use crate::robot::{Geometry, Inertial, MeshAsset};

/// Default density, kg/m^3: water, and the average of most robots.
pub(crate) const DENSITY: f64 = 1000.0;

/// Tolerance of a tensor, relative to its largest principal moment. Files print moments with four or five
/// digits, and flat or thin parts are on the border.
const ROUNDING: f64 = 1e-3;

/// Returns a tensor that is physical except for rounding, made positive semidefinite. The error is a fragment
/// of a sentence.
pub(crate) fn checked(tensor: DMat3) -> Result<DMat3, String> {
    let largest = tensor.to_cols_array().iter().fold(0.0_f64, |most, part| most.max(part.abs()));
    if largest == 0.0 {
        return Ok(tensor);
    }
    // Moments are small numbers, and the eigenvalues need their cubes.
    let unit = tensor * (1.0 / largest);
    let [a, b, c] = DSymmetricEigen3::eigenvalues(unit).to_array();
    if a.min(b).min(c) < -ROUNDING * c {
        return Err(format!("a principal moment of its inertia is negative ({})", short(a * largest)));
    }
    if c > (a + b) + ROUNDING * c {
        let [a, b, c] = [a, b, c].map(|moment| short(moment * largest));
        return Err(format!(
            "no body has the principal moments {a}, {b}, {c} (two must be at least the third)"
        ));
    }
    // Slightly negative moments are lifted to zero; rounding of the eigenvalues is left alone.
    let lift = if a < -1e-12 { -a * largest } else { 0.0 };
    Ok(tensor + DMat3::from_diagonal(DVec3::splat(lift)))
}

/// Returns `R I R'`: a tensor in rotated axes.
pub(crate) fn rotated(tensor: DMat3, rotation: DQuat) -> DMat3 {
    if rotation == DQuat::IDENTITY {
        return tensor;
    }
    let rotation = DMat3::from_quat(rotation);
    symmetric(rotation * tensor * rotation.transpose())
}

fn symmetric(tensor: DMat3) -> DMat3 {
    (tensor + tensor.transpose()) * 0.5
}

/// Returns mass and inertia of shapes with one density; overlaps count twice. `None` if they enclose no
/// volume.
pub(crate) fn of_shapes<'a>(shapes: impl Iterator<Item = (&'a DPose3, &'a Geometry)>) -> Option<Inertial> {
    let all = shapes
        .filter_map(|(pose, shape)| Some(of_shape(shape)?.transform_by(pose)))
        .reduce(|sum, next| sum + next)?;
    let inertial = inertial(&all);
    let sound = inertial.mass > 0.0
        && inertial.mass.is_finite()
        && inertial.center_of_mass.is_finite()
        && inertial.inertia.is_finite();
    sound.then_some(inertial)
}

fn inertial(properties: &MassProperties) -> Inertial {
    Inertial {
        mass: properties.mass(),
        center_of_mass: properties.local_com,
        inertia: symmetric(properties.reconstruct_inertia_matrix()),
    }
}

fn of_shape(shape: &Geometry) -> Option<MassProperties> {
    // The axis of parry's cylinders and cones is y, of URDF's z.
    let y_to_z = DPose3::from_rotation(DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2));
    Some(match shape {
        Geometry::Box { size } => MassProperties::from_cuboid(DENSITY, *size * 0.5),
        Geometry::Sphere { radius } => MassProperties::from_ball(DENSITY, *radius),
        Geometry::Cylinder { radius, length } => {
            MassProperties::from_cylinder(DENSITY, length * 0.5, *radius).transform_by(&y_to_z)
        }
        Geometry::Capsule { radius, length } => {
            let end = DVec3::Z * (length * 0.5);
            MassProperties::from_capsule(DENSITY, -end, end, *radius)
        }
        Geometry::Cone { radius, length } => {
            MassProperties::from_cone(DENSITY, length * 0.5, *radius).transform_by(&y_to_z)
        }
        // Infinite, so without a mass.
        Geometry::Plane { .. } => return None,
        Geometry::Mesh { scale, asset, .. } => of_mesh(asset.as_ref()?, *scale)?,
    })
}

/// Returns mass and inertia of a closed mesh; for an open one, those of its bounding box.
fn of_mesh(mesh: &MeshAsset, scale: DVec3) -> Option<MassProperties> {
    let vertices: Vec<DVec3> = mesh.vertices.iter().map(|vertex| *vertex * scale).collect();
    let low = vertices.iter().copied().reduce(DVec3::min)?;
    let high = vertices.iter().copied().reduce(DVec3::max)?;
    let size = high - low;
    let box_mass = size.x * size.y * size.z * DENSITY;

    let solid = MassProperties::from_trimesh(DENSITY, &vertices, &mesh.triangles);
    let found = inertial(&solid);
    let inside = found.center_of_mass.cmpge(low).all() && found.center_of_mass.cmple(high).all();
    // An open mesh may have any volume; a hundredth of its box is thinner than robots' parts.
    let plausible = found.mass >= 0.01 * box_mass && found.mass <= 1.001 * box_mass;
    if found.mass > 0.0 && inside && plausible && found.inertia.is_finite() && checked(found.inertia).is_ok()
    {
        return Some(solid);
    }
    let middle = DPose3::from_translation((low + high) * 0.5);
    (box_mass > 0.0).then(|| MassProperties::from_cuboid(DENSITY, size * 0.5).transform_by(&middle))
}
