//! Replacement shapes of collision meshes, and their error.

use glamx::{DPose3, DVec3};
use rapier3d_f64::parry::query::PointQuery as _;
use rapier3d_f64::parry::shape::TriMesh;
use simd_model::robot::MeshAsset;

use super::convex_mesh::ConvexMesh;
use super::part::{Made, MeshShapes};

/// Shape that replaces a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProxyShape {
    /// Its own triangles, or a height field if it is a grid.
    Mesh,
    /// Its convex hull.
    Hull,
    /// Convex parts, by number.
    Parts(usize),
}

/// Result of replacing a collision mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Proxy {
    /// URI, as the description names it.
    pub uri: String,
    /// Number of triangles of the mesh.
    pub triangles: usize,
    /// Shape that replaces it.
    pub shape: ProxyShape,
    /// Requested shapes.
    pub asked: MeshShapes,
    /// Whether its link can never move.
    pub is_fixed: bool,
    /// Largest distance found between the two surfaces, from some thousand points of each, metres.
    pub distance: f64,
    /// For a hull of only some of the mesh's corners: the largest distance of any other one outside of its
    /// faces, metres.
    pub simpler_by: Option<f64>,
    /// Links of its robot touch each other by the triangles of the mesh, and not by the hull.
    pub is_measured: bool,
}

/// Number of points of each surface that are measured.
const SAMPLES: usize = 1_000;

/// See [`Proxy::distance`].
pub(super) fn largest_distance(mesh: &MeshAsset, scale: DVec3, proxies: &[Made]) -> f64 {
    let corners: Vec<DVec3> = mesh.vertices.iter().map(|vertex| *vertex * scale).collect();
    let from_mesh = samples(&corners, &mesh.triangles).map(|point| to_proxies(point, proxies));
    let farthest = from_mesh.fold(0.0, f64::max);
    let Ok(surface) = TriMesh::new(corners.clone(), mesh.triangles.clone()) else { return farthest };
    let solids = proxies.iter().filter_map(|made| Some((made, ConvexMesh::of(&*made.shape)?)));
    let mut back = 0.0f64;
    for (made, solid) in solids {
        for point in samples(&solid.vertices, &solid.triangles) {
            let point = made.own_from_shape.transform_point(point);
            // Parts may overlap, with the surface of one inside another.
            let inside = proxies.iter().any(|other| {
                !std::ptr::eq(other, made) && other.shape.contains_point(&other.own_from_shape, point)
            });
            if !inside {
                back = back.max(surface.distance_to_local_point(point, false));
            }
        }
    }
    farthest.max(back)
}

/// Returns corners and centres of triangles, evenly spaced among all.
fn samples<'a>(corners: &'a [DVec3], triangles: &'a [[u32; 3]]) -> impl Iterator<Item = DVec3> + 'a {
    let middle =
        |triangle: &[u32; 3]| triangle.map(|corner| corners[corner as usize]).iter().sum::<DVec3>() / 3.0;
    let some = |count: usize| count.div_ceil(SAMPLES).max(1);
    let middles = triangles.iter().step_by(some(triangles.len())).map(middle);
    corners.iter().step_by(some(corners.len())).copied().chain(middles)
}

/// Returns the distance from a point to the surface of the union of some shapes.
fn to_proxies(point: DVec3, proxies: &[Made]) -> f64 {
    let distances = proxies.iter().map(|made| {
        let from = |pose: &DPose3| made.shape.project_point(pose, point, false);
        let projected = from(&made.own_from_shape);
        (projected.is_inside, projected.point.distance(point))
    });
    // Inside several, the depth is the largest one.
    let (mut inside, mut outside) = (None::<f64>, f64::INFINITY);
    for (is_inside, distance) in distances {
        if is_inside {
            inside = Some(inside.unwrap_or(0.0).max(distance));
        } else {
            outside = outside.min(distance);
        }
    }
    inside.unwrap_or(if outside.is_finite() { outside } else { 0.0 })
}
