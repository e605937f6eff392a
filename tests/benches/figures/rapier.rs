//! Costs of rapier's own collision world in place of simd's. Its broad phase is compared with the sweep over
//! robots, and its query pipeline with the tree of a call.

use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use glamx::{DPose3, DQuat, DVec3};
use rapier3d_f64::dynamics::{IntegrationParameters, RigidBodySet};
use rapier3d_f64::geometry::{BroadPhaseBvh, ColliderBuilder, ColliderHandle, ColliderSet, Ray, SharedShape};
use rapier3d_f64::parry::bounding_volume::{Aabb, BoundingVolume as _};
use rapier3d_f64::parry::query::DefaultQueryDispatcher;
use rapier3d_f64::pipeline::QueryFilter;
use simd_core::collision::{BroadPhase, ColliderGeometry, RobotColliders, Shapes, Surface};
use simd_core::dynamics::Tree;
use simd_core::dynamics::kinematics::BodyMotion;
use simd_model::RobotModel;
use simd_tests::statistics::Spread;
use simd_tests::{robots, scenes};

const BATCHES: usize = 40;
/// Rays of a call.
const RAYS: usize = 10_000;
/// Distance within which contacts of moving bodies are searched, metres.
const SLACK: f64 = 1e-3;

/// Prints the tables.
pub(crate) fn print() {
    println!("pairs with a moving shape that may touch: microseconds a step (median of {BATCHES} batches)");
    println!("  {:28} {:>12} {:>28}", "", "here", "rapier's BroadPhaseBvh");
    let one = |model: &Arc<RobotModel>| vec![(Arc::clone(model), DPose3::IDENTITY)];
    for (name, robots) in [
        ("A1", one(&robots::read("pybullet_data/a1/a1.urdf").0)),
        ("humanoid", one(&robots::read("humanoid/urdf/humanoid.urdf").0)),
        ("stack of ten boxes", pile(&scenes::cuboid(DVec3::splat(0.2), 1.0), [1, 1, 10], 0.2)),
        ("heap of 500 balls", pile(&scenes::ball(0.05, 0.1), [8, 8, 8], 0.1)),
    ] {
        broad(name, &robots);
    }
    println!("\n{RAYS} rays in a call among 1,000 balls and 1,000 boxes: microseconds");
    rays();
}

/// Returns a grid with this many robots along each axis.
fn pile(model: &Arc<RobotModel>, [nx, ny, nz]: [u32; 3], pitch: f64) -> Vec<(Arc<RobotModel>, DPose3)> {
    let places = (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])));
    let at = |cell: [u32; 3]| DPose3::from_translation(DVec3::from(cell.map(f64::from)) * pitch);
    places.map(|cell| (Arc::clone(model), at(cell))).collect()
}

/// Returns the poses of bodies with joints at 0.
fn at_zero(tree: &Tree) -> Vec<DPose3> {
    let mut poses: Vec<DPose3> = Vec::new();
    for body in &tree.bodies {
        let own = DPose3::from_parts(body.at_zero.origin, DQuat::from_mat3(&body.at_zero.rotation));
        poses.push(body.parent.map_or(own, |parent| poses[parent] * own));
    }
    poses
}

/// Returns rapier's shape of a collider, and its axes in those of the collider.
fn shape(geometry: &ColliderGeometry, shapes: &Shapes) -> Option<(SharedShape, DPose3)> {
    let upright = DPose3::from_rotation(DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2));
    let made = match *geometry {
        ColliderGeometry::Box { size } => SharedShape::cuboid(size.x / 2.0, size.y / 2.0, size.z / 2.0),
        ColliderGeometry::Sphere { radius } => SharedShape::ball(radius),
        ColliderGeometry::Capsule { radius, length } => SharedShape::capsule_z(length / 2.0, radius),
        ColliderGeometry::Cylinder { radius, length } => {
            return Some((SharedShape::cylinder(length / 2.0, radius), upright));
        }
        ColliderGeometry::Cone { radius, length } => {
            return Some((SharedShape::cone(length / 2.0, radius), upright));
        }
        ColliderGeometry::Plane { normal } => SharedShape::halfspace(normal),
        ColliderGeometry::Convex { sha256 } => {
            SharedShape::convex_hull(&shapes.convex_mesh(&sha256)?.vertices)?
        }
    };
    Some((made, DPose3::IDENTITY))
}

fn broad(name: &str, robots: &[(Arc<RobotModel>, DPose3)]) {
    let mut own = Vec::new();
    let mut others: Vec<(SharedShape, DPose3, ColliderHandle)> = Vec::new();
    let (mut set, bodies) = (ColliderSet::new(), RigidBodySet::new());
    for (model, root) in robots {
        let (tree, shapes) = (Tree::new(model, false), Arc::new(Shapes::new(model)));
        let poses: Vec<DPose3> = at_zero(&tree).into_iter().map(|pose| *root * pose).collect();
        for collider in shapes.colliders(&tree) {
            let Some((shape, turn)) = shape(&collider.geometry, &shapes) else { continue };
            let frame = &tree.links[collider.link];
            let body = frame.body.map_or(*root, |body| poses[body]);
            let pose = body * frame.body_from_link * collider.link_from_shape * turn;
            let handle = set.insert(ColliderBuilder::new(shape.clone()).position(pose));
            others.push((shape, pose, handle));
        }
        own.push((RobotColliders::new(&tree, &shapes, Surface::default()), poses));
    }
    let (parameters, mut tree) = (IntegrationParameters::default(), BroadPhaseBvh::new());
    let (mut sweep, mut events, mut boxes) = (BroadPhase::default(), Vec::new(), Vec::new());
    let (mut here, mut there) = (Vec::new(), Vec::new());
    for batch in 0..BATCHES * 4 {
        // A millimetre to and fro.
        let moved = DPose3::from_translation(DVec3::new(1e-3 * (batch as f64).sin(), 0.0, 5e-4));
        for (colliders, poses) in &mut own {
            colliders.update_poses(DPose3::IDENTITY, SLACK, 1e-3, |body| BodyMotion {
                pose: moved * poses[body],
                linear: DVec3::ZERO,
                angular: DVec3::ZERO,
            });
        }
        let start = Instant::now();
        let awake = own.iter().enumerate().map(|(robot, (colliders, _))| (robot, colliders, true));
        black_box(sweep.pairs(awake, false));
        here.push(start.elapsed().as_secs_f64() * 1e6);
        boxes.clear();
        boxes.extend(
            others
                .iter()
                .map(|(shape, pose, handle)| (*handle, shape.compute_aabb(&(moved * *pose)).loosened(SLACK))),
        );
        let start = Instant::now();
        boxes.iter().for_each(|(handle, bounds)| tree.set_aabb(&parameters, *handle, *bounds));
        tree.update(&parameters, &set, &bodies, &[], &[], &mut events);
        let queries = tree.as_query_pipeline(&DefaultQueryDispatcher, &bodies, &set, QueryFilter::default());
        let near = |bounds: &Aabb| queries.intersect_aabb_conservative(*bounds).count();
        black_box(boxes.iter().map(|(_, bounds)| near(bounds)).sum::<usize>());
        there.push(start.elapsed().as_secs_f64() * 1e6);
    }
    let late = |times: Vec<f64>| Spread::of(times.into_iter().skip(BATCHES).collect());
    println!("  {name:28} {} {}", late(here), late(there));
}

fn rays() {
    let mut world = scenes::world(1e-3);
    let (ball, house) = (scenes::ball(0.05, 0.1), scenes::cuboid(DVec3::ONE, 1.0));
    for (i, (model, pose)) in pile(&ball, [10, 10, 10], 0.3).into_iter().enumerate() {
        scenes::spawn(&mut world, scenes::robot(&format!("ball-{i}"), &model, pose, true));
    }
    for (i, (model, pose)) in pile(&house, [10, 10, 10], 4.0).into_iter().enumerate() {
        let pose = DPose3::from_translation(pose.translation + DVec3::splat(5.0));
        scenes::spawn(&mut world, scenes::robot(&format!("house-{i}"), &model, pose, true));
    }
    let state = scenes::look(&world);
    let start = DVec3::new(1.5, 1.5, 4.0);
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let ends: Vec<DVec3> = (0..RAYS)
        .map(|i| {
            let z = 1.0 - (2.0 * i as f64 + 1.0) / RAYS as f64;
            let (sin, cos) = (golden * i as f64).sin_cos();
            let across = (1.0 - z * z).sqrt();
            start + DVec3::new(across * cos, across * sin, z) * 100.0
        })
        .collect();
    let wanted: Vec<[DVec3; 2]> = ends.iter().map(|end| [start, *end]).collect();
    let mut times: [Vec<f64>; 4] = Default::default();
    let mut hits = [0; 2];
    for _ in 0..BATCHES {
        let mut time = |index: usize, work: &mut dyn FnMut() -> usize| {
            let began = Instant::now();
            let found = work();
            times[index].push(began.elapsed().as_secs_f64() * 1e6);
            found
        };
        let cast = |rays: &[[DVec3; 2]]| {
            let found = state.cast_rays(rays, None, &|| false).unwrap_or_default();
            found.iter().flatten().count()
        };
        time(0, &mut || cast(&wanted[..1]));
        hits[0] = time(1, &mut || cast(&wanted));
        let mut made = None;
        time(2, &mut || {
            made = Some(set_of(&state));
            0
        });
        let Some((set, bodies, tree)) = &made else { continue };
        hits[1] = time(3, &mut || {
            let filter = QueryFilter::default();
            let queries = tree.as_query_pipeline(&DefaultQueryDispatcher, bodies, set, filter);
            let cast = |end: &&DVec3| {
                queries.cast_ray_and_get_normal(&Ray::new(start, **end - start), 1.0, true).is_some()
            };
            ends.iter().filter(cast).count()
        });
    }
    let names = [
        "here, 1 ray with its tree",
        "here, all with their tree",
        "rapier, making set and tree",
        "rapier, all in that",
    ];
    for (name, times) in names.into_iter().zip(times) {
        println!("  {name:28} {}", Spread::of(times));
    }
    println!("  hits: {} here, {} in rapier", hits[0], hits[1]);
}

/// Makes the data from a published state that a call would need.
fn set_of(state: &simd_core::PublishedState) -> (ColliderSet, RigidBodySet, BroadPhaseBvh) {
    let (mut set, bodies) = (ColliderSet::new(), RigidBodySet::new());
    let (parameters, mut tree) = (IntegrationParameters::default(), BroadPhaseBvh::new());
    for (entity, root) in state.world.entities.iter().zip(&state.roots) {
        for collider in entity.shapes.colliders(&entity.tree) {
            let Some((shape, turn)) = shape(&collider.geometry, &entity.shapes) else { continue };
            let pose = root.pose * collider.link_from_shape * turn;
            let bounds = shape.compute_aabb(&pose);
            let handle = set.insert(ColliderBuilder::new(shape).position(pose));
            tree.set_aabb(&parameters, handle, bounds);
        }
    }
    (set, bodies, tree)
}
