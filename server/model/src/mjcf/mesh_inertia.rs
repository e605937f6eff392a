//! Masses and tensors of meshes, as MuJoCo computes them.

use glamx::{DMat3, DVec3};

use super::assets::MeshInertia;
use crate::inertia;
use crate::mesh::hull::{self, extremes};
use crate::robot::{Inertial, MeshAsset};

type Triangle = [DVec3; 3];

/// Number of directions in which vertices of a hull are searched.
pub(super) const DIRECTIONS: usize = 1_000;

/// Maximum number of vertices whose distance from a reduced hull is checked.
const COMPARED: usize = 20_000;

/// Returns mass and inertia for water, or for a surface with water's density as a number. For a reduced hull,
/// also returns the largest distance of another vertex from its faces, metres. `None` if the mesh has no
/// extent.
pub(super) fn of(mesh: &MeshAsset, scale: DVec3, kind: MeshInertia) -> Option<(Inertial, Option<f64>)> {
    let whole = |found: Option<Inertial>| Some((found?, None));
    match kind {
        MeshInertia::Volume { signed } => {
            whole(of_volume(&triangles(&mesh.vertices, &mesh.triangles, scale), signed))
        }
        MeshInertia::Hull => {
            let points: Vec<DVec3> = mesh.vertices.iter().map(|corner| *corner * scale).collect();
            let kept = is_reduced(mesh).then(|| extremes(&points, DIRECTIONS));
            let (corners, faces) = hull::of_corners(kept.as_ref().unwrap_or(&points)).ok()?;
            let faces = triangles(&corners, &faces, DVec3::ONE);
            let error = kept.is_some().then(|| farthest_outside(&points, &faces));
            Some((of_volume(&faces, true)?, error))
        }
        MeshInertia::Shell => whole(of_surface(&triangles(&mesh.vertices, &mesh.triangles, scale))),
    }
}

/// Returns the cost of this, in triangles whose volume is summed.
pub(super) fn work(mesh: &MeshAsset, kind: MeshInertia) -> usize {
    match kind {
        MeshInertia::Volume { .. } | MeshInertia::Shell => mesh.triangles.len(),
        MeshInertia::Hull if is_reduced(mesh) => {
            // A hull has at most twice as many faces as vertices.
            let compared = 2 * mesh.vertices.len().min(COMPARED);
            of_hull(DIRECTIONS) + (mesh.vertices.len() + compared) * DIRECTIONS / 20
        }
        MeshInertia::Hull => of_hull(mesh.vertices.len()),
    }
}

/// Returns the cost of the hull of `corners` vertices at worst.
pub(super) fn of_hull(corners: usize) -> usize {
    3 * corners * corners
}

/// Returns whether its hull is computed from the farthest vertices in [`DIRECTIONS`] only, because it has too
/// many.
pub(super) fn is_reduced(mesh: &MeshAsset) -> bool {
    mesh.vertices.len() > hull::MAX_VERTICES
}

/// Returns the largest distance of points from the planes of a hull's faces, for points picked evenly out of
/// all.
fn farthest_outside(points: &[DVec3], faces: &[Triangle]) -> f64 {
    let plane = |[a, b, c]: &Triangle| {
        let normal = (*b - *a).cross(*c - *a).try_normalize()?;
        Some((normal, a.dot(normal)))
    };
    let planes: Vec<(DVec3, f64)> = faces.iter().filter_map(plane).collect();
    let height = |point: &DVec3| {
        planes.iter().map(|(normal, along)| point.dot(*normal) - along).fold(f64::NEG_INFINITY, f64::max)
    };
    points.iter().step_by(points.len().div_ceil(COMPARED).max(1)).map(height).fold(0.0, f64::max)
}

fn triangles(corners: &[DVec3], faces: &[[u32; 3]], scale: DVec3) -> Vec<Triangle> {
    let corner = |index: u32| corners.get(index as usize).map(|corner| *corner * scale);
    faces.iter().filter_map(|[a, b, c]| Some([corner(*a)?, corner(*b)?, corner(*c)?])).collect()
}

fn area([a, b, c]: Triangle) -> f64 {
    (b - a).cross(c - a).length() * 0.5
}

/// Returns the area, and its centroid; `None` if there is none.
fn surface(triangles: &[Triangle]) -> Option<(f64, DVec3)> {
    let (mut whole, mut centroid) = (0.0, DVec3::ZERO);
    for triangle in triangles {
        let own = area(*triangle);
        let [a, b, c] = triangle;
        whole += own;
        centroid += (a + b + c) / 3.0 * own;
    }
    (whole > 0.0 && whole.is_finite()).then(|| (whole, centroid / whole))
}

/// Sums tetrahedra from the centroid of the surface to each triangle, and then from the centre of mass, for
/// volume and moments. Unless they are signed, each counts as positive, whichever way its triangle faces. So
/// the volume depends on the point.
fn of_volume(triangles: &[Triangle], signed: bool) -> Option<Inertial> {
    let (_, centroid) = surface(triangles)?;
    let volume_of = |[a, b, c]: Triangle| {
        let volume = a.dot(b.cross(c)) / 6.0;
        if signed { volume } else { volume.abs() }
    };
    let from = |point: DVec3| triangles.iter().map(move |triangle| triangle.map(|corner| corner - point));
    let (mut volume, mut center) = (0.0, DVec3::ZERO);
    for triangle in from(centroid) {
        let [a, b, c] = triangle;
        let own = volume_of(triangle);
        volume += own;
        center += ((a + b + c) * 0.25 + centroid) * own;
    }
    if volume.is_nan() || volume <= 0.0 {
        return None;
    }
    center /= volume;
    let (mut volume, mut products) = (0.0, DMat3::ZERO);
    for triangle in from(center) {
        let own = volume_of(triangle);
        volume += own;
        // Integral of r r' over a tetrahedron with one corner in the origin.
        products += squares(triangle) * (own / 20.0);
    }
    made(volume, center, products)
}

/// Sums thin triangles.
fn of_surface(triangles: &[Triangle]) -> Option<Inertial> {
    let (whole, center) = surface(triangles)?;
    let mut products = DMat3::ZERO;
    for triangle in triangles {
        // Integral of r r' over a triangle.
        products += squares(triangle.map(|corner| corner - center)) * (area(*triangle) / 12.0);
    }
    made(whole, center, products)
}

/// Returns the sum of the outer squares of the corners and of their sum.
fn squares([a, b, c]: Triangle) -> DMat3 {
    let square = |u: DVec3| DMat3::from_cols(u * u.x, u * u.y, u * u.z);
    square(a) + square(b) + square(c) + square(a + b + c)
}

fn made(extent: f64, center: DVec3, products: DMat3) -> Option<Inertial> {
    let trace = products.x_axis.x + products.y_axis.y + products.z_axis.z;
    let tensor = (DMat3::from_diagonal(DVec3::splat(trace)) - products) * inertia::DENSITY;
    let found = Inertial { mass: extent * inertia::DENSITY, center_of_mass: center, inertia: tensor };
    let is_sound = found.mass > 0.0 && found.mass.is_finite() && center.is_finite() && tensor.is_finite();
    is_sound.then_some(found)
}
