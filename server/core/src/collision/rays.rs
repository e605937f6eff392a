//! What a ray hits: the shapes of robots, placed where their links are.

use glamx::{DPose3, DVec3};
use rapier3d_f64::parry::bounding_volume::Aabb;
use rapier3d_f64::parry::partitioning::{Bvh, BvhBuildStrategy};
use rapier3d_f64::parry::query::Ray;
use rapier3d_f64::parry::shape::{ShapeType, SharedShape};

use super::Shapes;
use crate::dynamics::Tree;

/// Where a ray meets a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// As it was given to [`Scene::new`].
    pub robot: usize,
    /// Index of the link.
    pub link: usize,
    /// The part of the way from the ray's start to its end, 0 to 1.
    pub fraction: f64,
    /// World.
    pub point: DVec3,
    /// Out of the surface, world.
    pub normal: DVec3,
}

/// The shapes of robots at one moment. It is made for some rays and then forgotten: no step reads it.
pub struct Scene {
    /// Those with bounds, in the order of the tree's leaves, and after them the planes.
    shapes: Vec<Placed>,
    bounded: usize,
    tree: Bvh,
}

struct Placed {
    robot: usize,
    link: usize,
    shape: SharedShape,
    world_from_shape: DPose3,
}

impl Scene {
    /// Of robots, each with the number that its hits have, its tree, its shapes and `world_from_link` of
    /// each link. A plane that could move is left out, as it is where robots touch.
    pub fn new<'a>(robots: impl Iterator<Item = (usize, &'a Tree, &'a Shapes, Vec<DPose3>)>) -> Self {
        let (mut shapes, mut planes) = (Vec::new(), Vec::new());
        for (robot, tree, of, poses) in robots {
            for part in &of.parts {
                let (Some(pose), Some(frame)) = (poses.get(part.link), tree.links.get(part.link)) else {
                    continue;
                };
                let world_from_shape = *pose * part.link_from_shape;
                let placed = Placed { robot, link: part.link, shape: part.shape.clone(), world_from_shape };
                match part.shape.shape_type() {
                    ShapeType::HalfSpace if frame.body.is_some() => {}
                    ShapeType::HalfSpace => planes.push(placed),
                    _ => shapes.push(placed),
                }
            }
        }
        let bounds: Vec<Aabb> =
            shapes.iter().map(|placed| placed.shape.compute_aabb(&placed.world_from_shape)).collect();
        let tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &bounds);
        let bounded = shapes.len();
        shapes.append(&mut planes);
        Self { shapes, bounded, tree }
    }

    /// The first hit of the way from `from` to `to`, world points. A way that starts inside a shape hits
    /// it at its start.
    pub fn cast(&self, from: DVec3, to: DVec3) -> Option<RayHit> {
        let way = to - from;
        let ray = Ray::new(from, way);
        let meets = |index: usize, most: f64| {
            let placed = self.shapes.get(index)?;
            placed.shape.cast_ray(&placed.world_from_shape, &ray, most.min(1.0), true)
        };
        // The end of the way counts, and parry's search takes only what is before its limit.
        let mut most = 1.0_f64.next_up();
        let mut first = None;
        for index in self.bounded..self.shapes.len() {
            if let Some(fraction) = meets(index, most).filter(|fraction| *fraction < most) {
                (most, first) = (fraction, Some(index));
            }
        }
        let nearer = self.tree.cast_ray(&ray, most, |leaf, most| meets(leaf as usize, most));
        let index = nearer.map(|(leaf, _)| leaf as usize).or(first)?;
        let placed = self.shapes.get(index)?;
        let hit = placed.shape.cast_ray_and_get_normal(&placed.world_from_shape, &ray, 1.0, true)?;
        Some(RayHit {
            robot: placed.robot,
            link: placed.link,
            fraction: hit.time_of_impact,
            point: from + way * hit.time_of_impact,
            normal: outward(hit.normal, way),
        })
    }
}

/// The normal of a hit. Of a ray that is so long that its hit rounds to a ball's centre there is none: then
/// it is against the ray.
fn outward(normal: DVec3, way: DVec3) -> DVec3 {
    if normal.is_finite() { normal } else { -way.normalize_or_zero() }
}
