//! Triangles of surfaces that are near a whole robot, found once for all of its shapes. Most shapes are then
//! known to be far from them.

use glamx::DVec3;
use rapier3d_f64::parry::bounding_volume::Aabb;

use super::bounds::Bounds;
use super::colliders::RobotColliders;
use super::facets::Facets;

/// Number of triangles near a robot above which each of its shapes searches separately.
const MAX_COMMON_TRIANGLES: usize = 64;

/// Surfaces of two robots with few triangles near the other one. Reuses its memory, and keeps no other state.
#[derive(Default)]
pub(super) struct NearFacets {
    surfaces: Vec<Near>,
    /// Triangles of all surfaces, concatenated in order, each with its box in the surface's axes.
    triangles: Vec<(u32, Aabb)>,
    ids: Vec<u32>,
}

/// Triangles of one surface.
struct Near {
    /// Robot of the surface, 0 or 1.
    side: usize,
    collider: usize,
    /// Bounds of its triangles, world.
    bounds: Bounds,
    first: usize,
    last: usize,
}

impl NearFacets {
    /// Clears the triangles.
    pub(super) fn clear(&mut self) {
        self.surfaces.clear();
        self.triangles.clear();
    }

    /// Finds the triangles near the other robot, for surfaces among these colliders.
    pub(super) fn look(&mut self, side: usize, robot: &RobotColliders, colliders: &[usize], other: &Bounds) {
        let is_bounded = other.least.is_finite() && other.most.is_finite();
        if !robot.has_facets() || !is_bounded {
            return;
        }
        for &collider in colliders {
            let (placed, frame) = (&robot.placed[collider], &robot.frames[collider]);
            let Some(surface) = robot.facets(placed) else { continue };
            let around = other.seen_from(&frame.world_from_shape);
            if !surface.few_within(&around, MAX_COMMON_TRIANGLES, &mut self.ids) {
                continue;
            }
            let first = self.triangles.len();
            let mut whole = Aabb::new(DVec3::INFINITY, DVec3::NEG_INFINITY);
            for &id in &self.ids {
                let Some(bounds) = surface.bounds(id) else { continue };
                whole = Aabb::new(whole.mins.min(bounds.mins), whole.maxs.max(bounds.maxs));
                self.triangles.push((id, bounds));
            }
            let last = self.triangles.len();
            let bounds = if first == last {
                Bounds::default()
            } else {
                let half = [whole.center(), whole.half_extents()];
                Bounds::of_box(half, &frame.world_from_shape, ROUNDING * half[1].max_element())
            };
            self.surfaces.push(Near { side, collider, bounds, first, last });
        }
    }

    fn of(&self, side: usize, collider: usize) -> Option<&Near> {
        self.surfaces.iter().find(|near| near.side == side && near.collider == collider)
    }

    /// Returns the bounds of a collider's triangles that may touch the other robot, if they are known.
    pub(super) fn bounds(&self, side: usize, collider: usize) -> Option<&Bounds> {
        self.of(side, collider).map(|near| &near.bounds)
    }

    /// Returns the triangles of a collider, in order, that may touch the other robot, if they are known.
    pub(super) fn triangles(&self, side: usize, collider: usize) -> Option<&[(u32, Aabb)]> {
        self.of(side, collider).map(|near| &self.triangles[near.first..near.last])
    }
}

/// Relative margin of boxes, far above rounding.
const ROUNDING: f64 = 1e-9;

impl Bounds {
    /// Returns a box around this one in the axes of a shape.
    pub(super) fn seen_from(&self, world_from_shape: &glamx::DPose3) -> Aabb {
        let [middle, half] = [0.5 * (self.least + self.most), 0.5 * (self.most - self.least)];
        let Self { least, most } = Self::of_box(
            [middle, half],
            &world_from_shape.inverse(),
            ROUNDING * (half + world_from_shape.translation.abs() + middle.abs()).max_element(),
        );
        Aabb::new(least, most)
    }
}

impl Facets<'_> {
    /// Returns the box around a triangle; for a height field with the ground below it.
    fn bounds(self, id: u32) -> Option<Aabb> {
        let triangle = self.triangle(id)?;
        let bounds =
            Aabb::new(triangle.a.min(triangle.b).min(triangle.c), triangle.a.max(triangle.b).max(triangle.c));
        Some(match self {
            Self::Mesh(..) => bounds,
            Self::Field(field) => {
                let depth = super::facets::ground(field).mins.y;
                Aabb::new(bounds.mins.with_y(depth.min(bounds.mins.y)), bounds.maxs)
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glamx::{DPose3, DQuat};
    use simd_model::RobotModel;
    use simd_model::robot::{Collision, Geometry, Inertial, Link, Material, MeshAsset, Sha256};

    use super::*;
    use crate::collision::tests::cube;
    use crate::collision::{Filter, MeshShapes, NarrowPhase, Shapes, Surface};
    use crate::dynamics::Tree;
    use crate::dynamics::kinematics::BodyMotion;

    fn link() -> Link {
        let inertial = Inertial { mass: 1.0, ..Inertial::ZERO };
        Link { name: "link".into(), inertial, visuals: Vec::new(), collisions: Vec::new() }
    }

    /// The triangles that are gathered once for a robot equal those that each shape finds, to the bit. Also
    /// for a turned surface, and for height fields with shapes in the ground.
    #[test]
    fn triangles_that_are_gathered_for_a_robot_are_those_that_each_shape_finds() {
        let n = 12u32;
        let corner = |i: u32| {
            let (x, y) = (f64::from(i % n), f64::from(i / n));
            DVec3::new(
                x / f64::from(n - 1) - 0.5,
                0.5 - y / f64::from(n - 1),
                0.1 * (1.3 * x + 0.4 * y).sin(),
            )
        };
        let cell = |i: u32| {
            let a = i / (n - 1) * n + i % (n - 1);
            [[a, a + n, a + n + 1], [a, a + n + 1, a + 1]]
        };
        let asset = |grid| {
            Arc::new(MeshAsset {
                sha256: Sha256([7; 32]),
                vertices: (0..n * n).map(corner).collect(),
                triangles: (0..(n - 1) * (n - 1)).flat_map(cell).collect(),
                paints: Vec::new(),
                files: Vec::new(),
                grid,
            })
        };
        let size = n as usize;
        let grids = [None, Some(simd_model::robot::Grid { rows: size, columns: size })];
        let of = |geometry: Geometry| RobotModel {
            links: vec![Link {
                collisions: vec![Collision {
                    link_from_shape: DPose3::IDENTITY,
                    geometry,
                    material: Material::default(),
                }],
                ..link()
            }],
            ..RobotModel::default()
        };
        let mut points = 0;
        for grid in grids {
            let surface = of(Geometry::Mesh {
                uri: "surface".into(),
                scale: DVec3::new(4.0, 4.0, 1.0),
                asset: Some(asset(grid)),
            });
            let (tree, shapes) =
                (Tree::new(&surface, true), Arc::new(Shapes::reusing(&surface, true, MeshShapes::Mesh, &[])));
            let mut ground = RobotColliders::new(&tree, &shapes, Surface::default());
            let turn = DQuat::from_rotation_z(0.4) * DQuat::from_rotation_x(0.1);
            let world_from_ground = DPose3::from_parts(DVec3::new(0.2, -0.1, 0.3), turn);
            ground.update_poses(world_from_ground, 1e-3, 1e-3, |_| still(DPose3::IDENTITY));
            for i in 0..60 {
                let at = f64::from(i);
                let shape = match i % 4 {
                    0 => Geometry::Sphere { radius: 0.1 },
                    1 => Geometry::Box { size: DVec3::new(0.2, 0.3, 0.1) },
                    2 => Geometry::Cone { radius: 0.1, length: 0.2 },
                    _ => Geometry::Mesh { uri: "hull".into(), scale: DVec3::splat(0.2), asset: Some(cube()) },
                };
                let model = of(shape);
                let (tree, shapes) = (Tree::new(&model, false), Arc::new(Shapes::new(&model)));
                let mut body = RobotColliders::new(&tree, &shapes, Surface::default());
                let place =
                    DVec3::new(1.8 * (1.1 * at).sin(), 1.8 * (0.7 * at).cos(), 0.3 + 0.2 * (2.3 * at).sin());
                let pose =
                    DPose3::from_parts(place, DQuat::from_rotation_x(at) * DQuat::from_rotation_y(0.3 * at));
                body.update_poses(DPose3::IDENTITY, 1e-3, 1e-3, |_| still(pose));
                let mut narrow = NarrowPhase::default();
                let (mut gathered, mut alone) = (Vec::new(), Vec::new());
                narrow.between([&ground, &body], Filter::default(), &|| false, |point| gathered.push(point));
                let none = NearFacets::default();
                let (a, b) = (&ground.placed[0], &body.placed[0]);
                if a.bounds.meets(&b.bounds) {
                    narrow.pair([0, 0], [&ground, &body], [a, b], &none, &|| false, &mut |point| {
                        alone.push(point)
                    });
                }
                assert_eq!(format!("{gathered:?}"), format!("{alone:?}"), "{i}");
                points += alone.len();
            }
        }
        assert!(points > 100, "{points}");
    }

    fn still(pose: DPose3) -> BodyMotion {
        BodyMotion { pose, linear: DVec3::ZERO, angular: DVec3::ZERO }
    }
}
