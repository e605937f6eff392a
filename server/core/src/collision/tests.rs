//! Poses of colliders at their links.

use std::sync::Arc;

use glamx::{DPose3, DQuat, DVec3};
use simd_model::RobotModel;
use simd_model::robot::{
    Collision, Geometry, Joint, JointKind, JointLimits, Link, Material, MeshAsset, Sha256,
};

use super::scene::{PlacedShape, QueryShape, Scene};
use super::{Collider, ColliderGeometry, MeshShapes, Shapes};
use crate::dynamics::Tree;
use crate::simulation::WorldLimits;
use crate::simulation::command::{JointReset, RobotReset, Spawn};
use crate::{Command, PhysicsSettings, PublishedState, Simulation};

fn collision(at: DVec3, geometry: Geometry) -> Collision {
    Collision { link_from_shape: DPose3::from_translation(at), geometry, material: Material::default() }
}

pub(super) fn cube() -> Arc<MeshAsset> {
    let corners = (0..8).map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)));
    Arc::new(MeshAsset {
        sha256: Sha256([0; 32]),
        vertices: corners.collect(),
        triangles: vec![[0, 1, 2], [4, 5, 6]],
        paints: Vec::new(),
        files: Vec::new(),
        grid: None,
    })
}

/// Returns a base with a box, and an arm with a sphere and a cylinder. A pad is fixed to the arm, a mesh that
/// is scaled and mirrored. A frame touches nothing.
fn robot() -> RobotModel {
    let link = |name: &str, collisions| Link {
        name: name.into(),
        inertial: simd_model::robot::Inertial {
            mass: 1.0,
            inertia: glamx::DMat3::from_diagonal(DVec3::ONE),
            ..simd_model::robot::Inertial::ZERO
        },
        visuals: Vec::new(),
        collisions,
    };
    let joint = |name: &str, kind, parent, child| Joint {
        name: name.into(),
        kind,
        parent,
        child,
        parent_from_joint: DPose3::from_parts(DVec3::new(0.1, 0.2, 0.3), DQuat::from_rotation_x(0.4)),
        axis: DVec3::new(0.6, 0.0, 0.8),
        limits: JointLimits::default(),
        damping: 0.0,
        friction: 0.0,
        mimic: None,
    };
    let size = DVec3::new(0.1, 0.2, 0.3);
    let mesh =
        Geometry::Mesh { uri: "cube.stl".into(), scale: DVec3::new(0.1, -0.2, 0.3), asset: Some(cube()) };
    RobotModel {
        name: "robot".into(),
        links: vec![
            link("base", vec![collision(DVec3::Z, Geometry::Box { size })]),
            link(
                "arm",
                vec![
                    collision(DVec3::X, Geometry::Sphere { radius: 0.1 }),
                    collision(DVec3::Y, Geometry::Cylinder { radius: 0.1, length: 0.4 }),
                ],
            ),
            link("pad", vec![collision(DVec3::ZERO, mesh)]),
            link("frame", Vec::new()),
        ],
        joints: vec![
            joint("shoulder", JointKind::Continuous, 0, 1),
            joint("bolt", JointKind::Fixed, 1, 2),
            joint("wrist", JointKind::Continuous, 2, 3),
        ],
        ..RobotModel::default()
    }
}

fn world(fixed: bool) -> Simulation {
    let mut world = Simulation::new(PhysicsSettings::default(), WorldLimits::default());
    let model = Arc::new(robot());
    let spawn = Spawn {
        name: "robot".into(),
        allow_renaming: false,
        shapes: Arc::new(Shapes::new(&model)),
        model,
        pose: DPose3::from_translation(DVec3::new(1.0, 2.0, 3.0)),
        fixed_base: Some(fixed),
        passive: true,
        joint_positions: Vec::new(),
        joint_orientations: Vec::new(),
        contact_settings: Default::default(),
        collision_pairs: Vec::new(),
        free_place: Default::default(),
        loaded_at_start: false,
    };
    world.apply(&Command::Spawn(Box::new(spawn))).unwrap();
    world
}

#[test]
fn links_without_a_shape_have_no_colliders() {
    assert_eq!(world(true).collider_count(), 4);
    assert_eq!(world(false).collider_count(), 4);
}

#[test]
fn colliders_are_where_the_links_are_after_any_motion() {
    for fixed in [true, false] {
        let mut world = world(fixed);
        let joints = ["shoulder", "wrist"].map(|joint| JointReset {
            joint: joint.into(),
            axis: 0,
            position: 0.7,
            velocity: 3.0,
            ..Default::default()
        });
        let robots = vec![RobotReset { robot: "robot".into(), joints: joints.to_vec() }];
        world.apply(&Command::ResetJoints { robots }).unwrap();
        for _ in 0..300 {
            world.step();
        }
        let mut seen = PublishedState::default();
        world.observe(&mut seen);
        let links = seen.link_poses(0).unwrap();
        let model = robot();
        let poses = world.collider_poses("robot").unwrap();
        let shapes =
            model.links.iter().enumerate().flat_map(|(i, link)| link.collisions.iter().map(move |c| (i, c)));
        let mut count = 0;
        for ((link, collision), pose) in shapes.zip(&poses) {
            assert_eq!(pose.link, link);
            let expected = links[link] * collision.link_from_shape;
            assert!((pose.world_from_shape.translation - expected.translation).length() < 1e-12);
            // A cylinder's z, along which it is long, is parry's y.
            if let Geometry::Cylinder { .. } = collision.geometry {
                let along = pose.world_from_shape.rotation * DVec3::Y;
                assert!(along.dot(expected.rotation * DVec3::Z).abs() > 1.0 - 1e-12);
            }
            count += 1;
        }
        assert_eq!(count, 4);
    }
}

#[test]
fn colliders_go_with_their_robot_and_come_back_with_a_saved_state() {
    let mut world = world(true);
    world.apply(&Command::SaveState { name: "with".into() }).unwrap();
    world.apply(&Command::Delete { robot: "robot".into() }).unwrap();
    assert_eq!(world.collider_count(), 0);
    world.apply(&Command::RestoreState { name: "with".into() }).unwrap();
    assert_eq!(world.collider_count(), 4);
    assert_eq!(world.collider_poses("robot").unwrap().len(), 4);
}

/// Points on a plane have no hull; a plate replaces them.
#[test]
fn a_flat_mesh_and_one_without_points_are_no_trouble() {
    let mut model = robot();
    let flat = MeshAsset {
        sha256: Sha256([1; 32]),
        vertices: vec![DVec3::ZERO, DVec3::X, DVec3::Y],
        triangles: vec![[0, 1, 2]],
        paints: Vec::new(),
        files: Vec::new(),
        grid: None,
    };
    let empty = MeshAsset {
        sha256: Sha256([2; 32]),
        vertices: Vec::new(),
        triangles: Vec::new(),
        paints: Vec::new(),
        files: Vec::new(),
        grid: None,
    };
    for (mesh, shapes) in [(flat, 4), (empty, 3)] {
        let asset = Some(Arc::new(mesh));
        let geometry = Geometry::Mesh { uri: "m.stl".into(), scale: DVec3::ONE, asset };
        model.links[2].collisions[0].geometry = geometry;
        assert_eq!(Shapes::new(&model).len(), shapes);
    }
}

/// A ball of 20,000 corners, used a hundred times: one hull, of its extremes.
#[test]
fn the_hull_of_a_large_mesh_is_bounded_and_made_once() {
    let corner = |i: u32| {
        let (z, turn) = (1.0 - f64::from(i) / 10_000.0, f64::from(i) * 2.4);
        let across = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(across * turn.cos(), across * turn.sin(), z)
    };
    let vertices: Vec<DVec3> = (0..20_000).map(corner).collect();
    let asset = Arc::new(MeshAsset {
        sha256: Sha256([3; 32]),
        vertices,
        triangles: vec![[0, 1, 2]],
        paints: Vec::new(),
        files: Vec::new(),
        grid: None,
    });
    let geometry = Geometry::Mesh { uri: "ball.stl".into(), scale: DVec3::ONE, asset: Some(asset) };
    let mut model = robot();
    model.links[2].collisions = vec![collision(DVec3::ZERO, geometry); 100];
    let shapes = Shapes::new(&model);
    let hulls: Vec<_> = shapes.parts.iter().filter_map(|part| part.shape.as_convex_polyhedron()).collect();
    assert_eq!(hulls.len(), 100);
    assert!(hulls.iter().all(|hull| std::ptr::eq(*hull, hulls[0])));
    // Another robot with the same mesh shares its hull, and at another scale has a separate one.
    let known = Arc::new(shapes.clone());
    let other = Shapes::reusing(&model, false, MeshShapes::Hull, std::slice::from_ref(&known));
    assert!(
        other.parts.iter().zip(&known.parts).all(|(a, b)| a.link != 2 || Arc::ptr_eq(&a.shape.0, &b.shape.0))
    );
    let mut larger = model.clone();
    if let Geometry::Mesh { scale, .. } = &mut larger.links[2].collisions[0].geometry {
        *scale = DVec3::splat(2.0);
    }
    let larger = Shapes::reusing(&larger, false, MeshShapes::Hull, std::slice::from_ref(&known));
    let of_pad = |shapes: &Shapes| shapes.parts.iter().find(|part| part.link == 2).unwrap().shape.clone();
    assert!(!Arc::ptr_eq(&of_pad(&larger).0, &of_pad(&known).0));
    let corners = hulls[0].points();
    assert!(corners.len() <= 512);
    // It is still a ball: flat between the corners, by less than a fiftieth of its radius.
    let furthest = |direction: DVec3| corners.iter().map(|p| p.dot(direction)).fold(0.0, f64::max);
    for direction in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE.normalize()] {
        assert!((0.98..=1.0 + 1e-12).contains(&furthest(direction)), "{}", furthest(direction));
    }
}

/// Returns two bars of a metre at a right angle, as a robot of one link.
fn bars() -> RobotModel {
    let corner = [
        DVec3::ZERO,
        DVec3::X,
        DVec3::new(1.0, 0.2, 0.0),
        DVec3::new(0.2, 0.2, 0.0),
        DVec3::new(0.2, 1.0, 0.0),
        DVec3::Y,
    ];
    let vertices: Vec<DVec3> =
        corner.iter().copied().chain(corner.iter().map(|point| *point + DVec3::Z * 0.2)).collect();
    // Below and above as fans about the inner corner, then the walls.
    let fan = [[3, 0, 1], [3, 1, 2], [3, 5, 0], [3, 4, 5]];
    let below = fan.iter().map(|[a, b, c]| [*a, *c, *b]);
    let above = fan.iter().map(|face| face.map(|corner| corner + 6));
    let walls = (0..6).flat_map(|a| {
        let b = (a + 1) % 6;
        [[a, b, b + 6], [a, b + 6, a + 6]]
    });
    let asset = Arc::new(MeshAsset {
        sha256: Sha256([7; 32]),
        vertices,
        triangles: below.chain(above).chain(walls).collect(),
        paints: Vec::new(),
        files: Vec::new(),
        grid: None,
    });
    let mut model = robot();
    let mesh = Geometry::Mesh { uri: "corner.stl".into(), scale: DVec3::ONE, asset: Some(asset) };
    model.links[0].collisions = vec![collision(DVec3::ZERO, mesh)];
    model.links.iter_mut().skip(1).for_each(|link| link.collisions.clear());
    model
}

/// The hull of two bars fills the corner between them; parts of a voxel's size do not.
#[test]
fn a_mesh_is_taken_apart_where_that_is_asked_for() {
    let model = bars();
    let hull = Shapes::reusing(&model, false, MeshShapes::Hull, &[]);
    let parts = Arc::new(Shapes::reusing(&model, false, MeshShapes::Decomposition, &[]));
    assert_eq!(hull.len(), 1);
    assert!((2..=32).contains(&parts.len()), "{}", parts.len());
    let inside = |shapes: &Shapes, point: DVec3| {
        shapes.parts.iter().any(|part| part.shape.contains_point(&part.link_from_shape, point))
    };
    let (in_bar, between) = (DVec3::new(0.7, 0.1, 0.1), DVec3::new(0.55, 0.4, 0.1));
    assert!(inside(&hull, in_bar) && inside(&hull, between));
    assert!(inside(&parts, in_bar) && !inside(&parts, between));
    // The kind of shapes is part of a hull's key.
    let again = Shapes::reusing(&model, false, MeshShapes::Hull, std::slice::from_ref(&parts));
    assert_eq!(again.len(), 1);
}

/// They are read back from parry's shapes.
#[test]
fn colliders_of_primitives_equal_the_description() {
    let model = robot();
    let shapes = Shapes::new(&model);
    let colliders: Vec<Collider> = shapes.colliders(&Tree::new(&model, true)).collect();
    assert_eq!(colliders.iter().map(|collider| collider.link).collect::<Vec<_>>(), [0, 1, 1, 2]);
    assert_eq!(colliders[0].geometry, ColliderGeometry::Box { size: DVec3::new(0.1, 0.2, 0.3) });
    assert_eq!(colliders[1].geometry, ColliderGeometry::Sphere { radius: 0.1 });
    assert_eq!(colliders[2].geometry, ColliderGeometry::Cylinder { radius: 0.1, length: 0.4 });
    assert!(matches!(colliders[3].geometry, ColliderGeometry::Convex { .. }), "{colliders:?}");
    let placed =
        model.links.iter().flat_map(|link| &link.collisions).map(|collision| collision.link_from_shape);
    for (collider, pose) in colliders.iter().zip(placed) {
        // A cylinder is turned to parry's axis and back, which rounds: a few times 1e-16.
        let off = pose.inverse() * collider.link_from_shape;
        let turn = off.rotation.xyz().length();
        assert!(off.translation.length() + turn < 1e-15, "{collider:?}");
    }
}

/// The vertices are those that parry keeps, and its triangles enclose what it encloses.
#[test]
fn convex_colliders_are_found_by_their_hash() {
    let model = bars();
    for meshes in [MeshShapes::Hull, MeshShapes::Decomposition] {
        let shapes = Shapes::reusing(&model, false, meshes, &[]);
        let colliders: Vec<Collider> = shapes.colliders(&Tree::new(&model, true)).collect();
        assert_eq!(colliders.len(), shapes.len());
        for (collider, part) in colliders.iter().zip(&shapes.parts) {
            let ColliderGeometry::Convex { sha256 } = &collider.geometry else { panic!("{collider:?}") };
            let mesh = shapes.convex_mesh(sha256).unwrap();
            let hull = part.shape.as_convex_polyhedron().unwrap();
            assert_eq!((mesh.vertices.as_slice(), mesh.sha256()), (hull.points(), *sha256));
            // The divergence theorem: a sixth of the sum of a . (b x c) over triangles that wind outwards.
            let signed = |triangle: &[u32; 3]| {
                let [a, b, c] = triangle.map(|vertex| mesh.vertices[vertex as usize]);
                a.dot(b.cross(c)) / 6.0
            };
            let volume: f64 = mesh.triangles.iter().map(signed).sum();
            let exact = part.shape.mass_properties(1.0).mass();
            assert!((volume - exact).abs() < 1e-9 * exact, "{volume} {exact}");
        }
        assert!(shapes.convex_mesh(&Sha256([9; 32])).is_none());
    }
}

#[test]
fn a_plane_that_could_move_is_not_a_collider() {
    let mut model = robot();
    model.links.truncate(1);
    model.joints.clear();
    model.links[0].collisions = vec![collision(DVec3::ZERO, Geometry::Plane { normal: DVec3::Y })];
    let shapes = Shapes::new(&model);
    let colliders = |fixed| -> Vec<ColliderGeometry> {
        shapes.colliders(&Tree::new(&model, fixed)).map(|collider| collider.geometry).collect()
    };
    assert_eq!(colliders(true), [ColliderGeometry::Plane { normal: DVec3::Y }]);
    assert_eq!(colliders(false), []);
}

/// A tree takes only finite boxes: other shapes are tested separately, and shapes at positions that are not
/// finite are left out.
#[test]
fn questions_meet_shapes_whose_boxes_are_not_finite() {
    let query = |geometry: Geometry| QueryShape::new(&geometry).unwrap();
    let place = |robot: usize, shape: &QueryShape, x: f64| {
        let mut placed = PlacedShape::of_no_robot(shape, DPose3::from_translation(DVec3::new(x, 0.0, 0.0)));
        placed.robot = robot;
        placed
    };
    let cube = query(Geometry::Box { size: DVec3::ONE });
    // Its far side is beyond the largest number.
    let huge = query(Geometry::Box { size: DVec3::splat(1.6e308) });
    let mut shapes =
        vec![place(20, &huge, 1.2e308), place(21, &cube, f64::INFINITY), place(22, &cube, f64::NAN)];
    shapes.extend((0..20).map(|robot| place(robot, &cube, 3.0 * robot as f64)));
    let scene = Scene::new(shapes);
    let ball = query(Geometry::Sphere { radius: 0.1 });
    for robot in 0..20 {
        let middle = DVec3::new(3.0 * robot as f64, 0.0, 0.0);
        let found = scene.overlaps(&ball, DPose3::from_translation(middle), false, &|| false);
        assert_eq!(found.into_iter().collect::<Vec<_>>(), [(robot, 0)]);
        let hit = scene.cast(middle + DVec3::Z * 5.0, middle - DVec3::Z * 5.0, |_| true);
        assert!(hit.is_some_and(|hit| hit.robot == robot), "{hit:?}");
    }
    let met = scene.fraction(DVec3::Y * 5.0, DVec3::new(1.6e308, 5.0, 0.0), |_| true);
    assert!(met.is_some_and(|fraction| (fraction - 0.25).abs() < 1e-9), "{met:?}");
}
