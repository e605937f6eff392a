//! Primitives that are fitted to a mesh, as in MuJoCo (`mjCMesh::FitGeom`, user_mesh.cc). They are fitted to
//! the box of the mesh's inertia. With the compiler's `fitaabb`, they are fitted to its extent along the
//! principal axes of the inertia.

use glamx::{DMat3, DPose3, DQuat, DVec3};

use super::defaults::Classed;
use super::geom::{Context, mesh_of};
use super::mesh_inertia;
use crate::report::Disposition::Ignored;
use crate::robot::Inertial;
use crate::translation::notes::{Notes, Stop};
use crate::urdf::findings::quoted;

/// Types of geoms that are fitted if they name a mesh.
const PRIMITIVES: [&str; 5] = ["sphere", "capsule", "cylinder", "ellipsoid", "box"];

/// Three numbers of `size`, and `geom_from_fitted` in the frame of the mesh's file.
pub(super) struct Fitted {
    pub(super) size: [f64; 3],
    pub(super) geom_from_fitted: DPose3,
}

/// Returns whether a geom is fitted to a mesh.
pub(super) fn is_fitted(geom: &Classed, kind: &str) -> bool {
    PRIMITIVES.contains(&kind) && geom.word("mesh").is_some()
}

/// Fits a primitive to the mesh that a geom names; `None` if the mesh cannot be read.
pub(super) fn fit(
    geom: &Classed,
    kind: &str,
    context: &Context,
    notes: &mut Notes,
) -> Result<Option<Fitted>, Stop> {
    let element = geom.element;
    let name = geom.word("mesh").unwrap_or_default();
    let lost = |notes: &mut Notes, why: &str| {
        let message = format!("the {kind} is fitted to the mesh {}, {why}: left out", quoted(name));
        notes.warn(element, Ignored, message);
        Ok(None)
    };
    let Some(asset) = context.library.meshes.get(name) else {
        return lost(notes, "which does not exist");
    };
    let Some(mesh) = mesh_of(element, asset, context)? else {
        return lost(notes, "which cannot be read");
    };
    context.made.spend(mesh_inertia::work(&mesh, asset.inertia), element)?;
    let Some((inertial, _)) = mesh_inertia::of(&mesh, asset.scale, asset.inertia) else {
        return lost(notes, "which has no volume");
    };
    let (principal, moments) = principal(&inertial);
    let (mut center, size) = if context.compiler.fit_extent {
        let back = principal.inverse();
        let scale = asset.scale;
        let points = || mesh.vertices.iter().map(move |corner| back.transform_point(*corner * scale));
        extent(kind, points)
    } else {
        (DVec3::ZERO, of_box(kind, half_sizes(inertial.mass, moments)))
    };
    if !center.is_finite() || size.iter().any(|size| !size.is_finite()) {
        return lost(notes, "which has no extent");
    }
    center = principal.transform_point(center);
    let factor = geom.number("fitscale")?.unwrap_or(1.0);
    Ok(Some(Fitted {
        size: size.map(|size| size * factor),
        geom_from_fitted: asset.geom_from_mesh * DPose3::from_parts(center, principal.rotation),
    }))
}

/// Returns the frame of the centre of mass and the principal axes, the largest moment first.
fn principal(inertial: &Inertial) -> (DPose3, DVec3) {
    let eigen = glamx::DSymmetricEigen3::new(inertial.inertia);
    let axes = eigen.eigenvectors;
    let mut all = [
        (eigen.eigenvalues.x, axes.x_axis),
        (eigen.eigenvalues.y, axes.y_axis),
        (eigen.eigenvalues.z, axes.z_axis),
    ];
    all.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    let [(x, first), (y, second), (z, _)] = all;
    let axes = DMat3::from_cols(first, second, first.cross(second));
    let rotation = DQuat::from_mat3(&axes).normalize();
    (DPose3::from_parts(inertial.center_of_mass, rotation), DVec3::new(x, y, z))
}

/// Returns the half sizes of the box with a mass and principal moments.
fn half_sizes(mass: f64, moments: DVec3) -> DVec3 {
    let all = moments.x + moments.y + moments.z;
    // I_x = m (b^2 + c^2) / 3 of a box with half sizes a, b and c.
    let half = |moment: f64| (1.5 * (all - 2.0 * moment) / mass).max(0.0).sqrt();
    DVec3::new(half(moments.x), half(moments.y), half(moments.z))
}

/// Returns the sizes of a primitive that replaces a box.
fn of_box(kind: &str, half: DVec3) -> [f64; 3] {
    let across = 0.5 * (half.x + half.y);
    match kind {
        "sphere" => [(half.x + half.y + half.z) / 3.0, 0.0, 0.0],
        "capsule" => [across, (half.z - 0.5 * across).max(0.0), 0.0],
        "cylinder" => [across, half.z, 0.0],
        _ => half.to_array(),
    }
}

/// Returns the middle of all points, and the sizes of a primitive that replaces the box around them.
fn extent<P: Iterator<Item = DVec3>>(kind: &str, points: impl Fn() -> P) -> (DVec3, [f64; 3]) {
    let low = points().fold(DVec3::INFINITY, DVec3::min);
    let high = points().fold(DVec3::NEG_INFINITY, DVec3::max);
    let half = 0.5 * (high - low);
    let across = half.x.max(half.y);
    let size = match kind {
        "sphere" => [half.max_element(), 0.0, 0.0],
        "capsule" => [across, (half.z - across).max(0.0), 0.0],
        "cylinder" => [across, half.z, 0.0],
        _ => half.to_array(),
    };
    (0.5 * (low + high), size)
}
