//! What stands for a collision mesh, and how far it is from it.

use glamx::{DPose3, DVec3};
use rapier3d_f64::parry::query::PointQuery as _;
use rapier3d_f64::parry::shape::TriMesh;
use simd_model::robot::MeshAsset;

use super::MeshShapes;
use super::geometry::ConvexMesh;
use super::shapes::Made;

/// What stands for a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProxyShape {
    /// Its own triangles or, where it is a grid, a height field.
    Mesh,
    /// Its convex hull.
    Hull,
    /// So many convex parts.
    Parts(usize),
}

/// What a collision mesh became.
#[derive(Clone, Debug, PartialEq)]
pub struct Proxy {
    /// As the description names it.
    pub uri: String,
    /// Triangles of the mesh.
    pub triangles: usize,
    /// What stands for it.
    pub shape: ProxyShape,
    /// What was asked for.
    pub asked: MeshShapes,
    /// Whether its link can never move.
    pub is_fixed: bool,
    /// The largest distance that was found between the surfaces of the two, looked for from some thousand points of
    /// each, metres.
    pub distance: f64,
    /// Of a hull that was made of some of the mesh's corners alone: how far any other one lies outside of its faces at the
    /// most, metres.
    pub simpler_by: Option<f64>,
}

/// Points of each surface from which the other one is looked for.
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
            // Where parts overlap, the surface of one is inside of another.
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

/// Corners and middles of triangles, evenly out of all.
fn samples<'a>(corners: &'a [DVec3], triangles: &'a [[u32; 3]]) -> impl Iterator<Item = DVec3> + 'a {
    let middle =
        |triangle: &[u32; 3]| triangle.map(|corner| corners[corner as usize]).iter().sum::<DVec3>() / 3.0;
    let some = |count: usize| count.div_ceil(SAMPLES).max(1);
    let middles = triangles.iter().step_by(some(triangles.len())).map(middle);
    corners.iter().step_by(some(corners.len())).copied().chain(middles)
}

/// From a point to the surface of what is made of some shapes.
fn to_proxies(point: DVec3, proxies: &[Made]) -> f64 {
    let distances = proxies.iter().map(|made| {
        let from = |pose: &DPose3| made.shape.project_point(pose, point, false);
        let projected = from(&made.own_from_shape);
        (projected.is_inside, projected.point.distance(point))
    });
    // Inside of some it is as deep as in the deepest.
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
