//! Free places of new robots: beside all others, and on the ground.

use std::sync::Arc;

use fastrand::Rng;
use glamx::{DPose3, DQuat, DVec3};
use simd_core::collision::Shapes;
use simd_core::simulation::command::*;
use simd_core::simulation::free_place::FreePlace;
use simd_core::{Command, Simulation};
use simd_model::RobotModel;
use simd_model::robot::{Collision, Geometry, MeshAsset, Sha256, Visual};
use simd_tests::scenes;
use simd_tests::world::{apply, look, passive, run, world};

use crate::chains::chain;
use crate::seeds::{held, seeds};

const ANYWHERE: FreePlace = FreePlace { beside_others: true, on_ground: true };

fn vector(rng: &mut Rng, size: f64) -> DVec3 {
    DVec3::new(rng.f64() - 0.5, rng.f64() - 0.5, rng.f64() - 0.5) * 2.0 * size
}

/// Returns a chain whose links have boxes at random poses, and some none.
fn robot(rng: &mut Rng, name: &str) -> Spawn {
    let mut model: RobotModel = chain(rng.usize(0..4));
    for link in &mut model.links {
        if rng.u8(0..5) == 0 {
            continue;
        }
        let rotation = DQuat::from_scaled_axis(vector(rng, 3.0));
        link.collisions = vec![Collision {
            link_from_shape: DPose3::from_parts(vector(rng, 0.3), rotation),
            geometry: Geometry::Box { size: vector(rng, 0.5).abs() + 0.01 },
            material: Default::default(),
        }];
    }
    let model = Arc::new(model);
    let pose = DPose3::from_parts(vector(rng, 2.0), DQuat::from_scaled_axis(vector(rng, 3.0)));
    Spawn {
        name: name.into(),
        pose,
        shapes: Arc::new(Shapes::new(&model)),
        ..passive(&model, rng.bool(), &[])
    }
}

fn bounds(world: &Simulation, robot: usize) -> Option<[DVec3; 2]> {
    let boxes = look(world).link_bounds(robot).into_iter().map(|(_, corners)| corners);
    boxes.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
}

#[test]
fn a_robot_that_asks_for_a_free_place_overlaps_none_and_is_above_the_ground() {
    let count = seeds("SIMD_FREE_PLACES", 300);
    let mut failed = Vec::new();
    for seed in 0..count {
        let mut rng = Rng::with_seed(seed);
        let mut world = world(1e-3);
        // The ground is below all, and no robot goes beside it.
        let first = usize::from(rng.bool());
        if first == 1 {
            let plane = scenes::plane(DVec3::Z);
            scenes::spawn(&mut world, scenes::robot("ground", &plane, DPose3::IDENTITY, true));
        }
        let is_placed = (first..first + 6).all(|index| {
            let asked = Spawn { free_place: ANYWHERE, ..robot(&mut rng, &format!("robot_{index}")) };
            let pose = asked.pose;
            scenes::spawn(&mut world, asked);
            let way = look(&world).roots[index].pose.translation - pose.translation;
            let bounds: Vec<_> = (first..=index).map(|robot| bounds(&world, robot)).collect();
            let Some((Some([lower, _]), others)) = bounds.split_last() else { return way.z == 0.0 };
            let mut ends = others.iter().flatten().map(|[_, upper]| upper.y);
            way.x == 0.0
                && way.y >= 0.0
                && way.z >= 0.0
                && lower.z > -1.1e-3
                && ends.all(|end| lower.y > end + 0.2 - 1e-9)
                && look(&world).way_to_free_place(index) < Some(1e-9)
        });
        if !is_placed {
            failed.push(seed);
        }
    }
    held("free places", count, 0.0, &failed);
}

#[test]
fn a_robot_with_room_stays_where_it_was_asked_to_be() {
    let mut world = world(1e-3);
    for (name, y) in [("right", -3.0), ("left", 3.0)] {
        let model = Arc::new(chain(1));
        let pose = DPose3::from_translation(DVec3::Y * y);
        let asked = Spawn { name: name.into(), pose, free_place: ANYWHERE, ..passive(&model, false, &[]) };
        apply(&mut world, Command::Spawn(Box::new(asked)));
    }
    let y = look(&world).roots.iter().map(|root| root.pose.translation.y).collect::<Vec<_>>();
    assert_eq!(y, [-3.0, 3.0]);
}

/// They keep their places relative to each other.
#[test]
fn robots_of_one_file_move_together() {
    let cube = |name: &str, y: f64| {
        let mut model = chain(0);
        model.links[0].collisions = vec![Collision {
            link_from_shape: DPose3::IDENTITY,
            geometry: Geometry::Box { size: DVec3::ONE },
            material: Default::default(),
        }];
        let model = Arc::new(model);
        let pose = DPose3::from_translation(DVec3::Y * y);
        let shapes = Arc::new(Shapes::new(&model));
        Spawn { name: name.into(), pose, shapes, free_place: ANYWHERE, ..passive(&model, false, &[]) }
    };
    let mut world = world(1e-3);
    apply(&mut world, Command::Spawn(Box::new(cube("alone", 0.0))));
    apply(&mut world, Command::SpawnAll(vec![cube("a", 0.0), cube("b", 2.0)]));
    let at = |world: &Simulation| {
        look(world).roots.iter().map(|root| root.pose.translation.to_array()).collect::<Vec<_>>()
    };
    let expected = [[0.0, 0.0, 0.5], [0.0, 1.2, 0.5], [0.0, 3.2, 0.5]];
    for (at, expected) in at(&world).iter().zip(expected) {
        assert!(DVec3::from(*at).distance(expected.into()) < 1e-12, "{at:?} {expected:?}");
    }
    // The free place is the spawn pose, which a reset restores.
    apply(
        &mut world,
        Command::SetEntityState { robot: "a".into(), pose: Some(DPose3::IDENTITY), twist: None },
    );
    run(&mut world, 1e-2);
    apply(&mut world, Command::Reset(ResetScope { state: true, ..ResetScope::default() }));
    assert!(DVec3::from(at(&world)[1]).distance(DVec3::new(0.0, 1.2, 0.5)) < 1e-12);
}

fn visual(z: f64, geometry: Geometry) -> Visual {
    Visual { link_from_shape: DPose3::from_translation(DVec3::Z * z), geometry, color: None, texture: None }
}

/// Their visuals take the place of collision shapes, also those of meshes, and planes have no lowest point.
#[test]
fn robots_without_collision_shapes_stand_on_the_ground_and_beside_others() {
    let asset = MeshAsset {
        sha256: Sha256([0; 32]),
        vertices: vec![DVec3::ZERO, DVec3::X, DVec3::new(0.0, 0.5, -0.5)],
        triangles: vec![[0, 1, 2]],
        paints: Vec::new(),
        files: Vec::new(),
        grid: None,
    };
    let mesh = Geometry::Mesh { uri: "a.stl".into(), scale: DVec3::splat(2.0), asset: Some(Arc::new(asset)) };
    let looks = [
        visual(0.0, Geometry::Box { size: DVec3::ONE }),
        visual(-0.25, Geometry::Sphere { radius: 0.5 }),
        visual(0.0, mesh),
        visual(-3.0, Geometry::Plane { normal: DVec3::Z }),
    ];
    let mut world = world(1e-3);
    for (index, look) in looks.into_iter().enumerate() {
        let mut model = chain(0);
        model.links[0].visuals = vec![look];
        let model = Arc::new(model);
        let shapes = Arc::new(Shapes::new(&model));
        let name = format!("robot_{index}");
        let asked = Spawn { name, shapes, free_place: ANYWHERE, ..passive(&model, false, &[]) };
        apply(&mut world, Command::Spawn(Box::new(asked)));
    }
    let expected = [[0.0, 0.5], [1.2, 0.75], [1.9, 1.0], [3.9, 0.0]];
    for (root, [y, z]) in look(&world).roots.iter().zip(expected) {
        let at = root.pose.translation;
        assert!(at.distance(DVec3::new(0.0, y, z)) < 1e-12, "{at:?}: y {y}, z {z}");
    }
}

/// A robot that is drawn below its collision shapes stands on these.
#[test]
fn visuals_do_not_count_if_their_link_has_collision_shapes() {
    let mut model = chain(0);
    model.links[0].collisions = vec![Collision {
        link_from_shape: DPose3::IDENTITY,
        geometry: Geometry::Sphere { radius: 0.25 },
        material: Default::default(),
    }];
    model.links[0].visuals = vec![visual(0.0, Geometry::Box { size: DVec3::ONE })];
    let model = Arc::new(model);
    let mut world = world(1e-3);
    let shapes = Arc::new(Shapes::new(&model));
    let asked = Spawn { shapes, free_place: ANYWHERE, ..passive(&model, false, &[]) };
    apply(&mut world, Command::Spawn(Box::new(asked)));
    assert_eq!(look(&world).roots[0].pose.translation, DVec3::Z * 0.25);
}
