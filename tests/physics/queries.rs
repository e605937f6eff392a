//! Distances, overlaps, bounds, casts of shapes and rays, from a published state.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use glamx::{DPose3, DQuat, DVec3};
use simd_core::dynamics::Configuration;
use simd_core::simulation::command::{CollisionFilterChange, CollisionPair, LinkProperties, Spawn};
use simd_core::simulation::queries::{DistanceQuery, DistanceReport, QueryBody, QuerySide};
use simd_core::{Command, PublishedState, Simulation};
use simd_model::robot::Geometry;
use simd_tests::scenes::{apply, ball, cuboid, look, plane, robot, solid, spawn, world};

use crate::chains::chain;
use crate::grounds::{grid, ground, mesh};
use simd_tests::world::passive;

pub(crate) fn at(place: DVec3) -> DPose3 {
    DPose3::from_translation(place)
}

pub(crate) fn body(robot: usize) -> QueryBody {
    QueryBody { robot, link: None, configuration: None }
}

pub(crate) fn all(a: QueryBody, b: Option<QueryBody>) -> DistanceQuery {
    let (a, b) = (a.into(), b.map(Into::into));
    DistanceQuery { a, b, within: f64::INFINITY, nearest_only: false, filtered: false }
}

pub(crate) fn ask(state: &PublishedState, query: &DistanceQuery) -> Vec<DistanceReport> {
    state.distances(query, &|| false).unwrap()
}

/// Returns the ground, a ball of 0.1 m with its centre 1 m above it, and a box of 0.2 m beside it.
pub(crate) fn scene() -> Simulation {
    let mut world = world(1e-3);
    spawn(&mut world, robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true));
    spawn(&mut world, robot("ball", &ball(0.1, 1.0), at(DVec3::Z), false));
    spawn(&mut world, robot("box", &cuboid(DVec3::splat(0.2), 1.0), at(DVec3::new(0.5, 0.0, 1.0)), false));
    world
}

#[test]
fn a_robot_is_measured_against_all_others_or_one() {
    let seen = look(&scene());
    let found = ask(&seen, &all(body(1), None));
    let named: Vec<_> = found.iter().map(|pair| (&*pair.robots[1], pair.distance)).collect();
    assert_eq!(named.len(), 2);
    assert!(named[0].0 == "ground" && (named[0].1 - 0.9).abs() < 1e-12, "{named:?}");
    assert!(named[1].0 == "box" && (named[1].1 - 0.3).abs() < 1e-9, "{named:?}");
    let beside = &found[1];
    assert!(beside.points[0].distance(DVec3::new(0.1, 0.0, 1.0)) < 1e-9, "{beside:?}");
    assert!(beside.points[1].distance(DVec3::new(0.4, 0.0, 1.0)) < 1e-9, "{beside:?}");
    assert!(beside.normal.distance(DVec3::X) < 1e-9, "{beside:?}");
    let near = DistanceQuery { within: 0.5, ..all(body(1), None) };
    assert_eq!(ask(&seen, &near).len(), 1);
    let nearest = DistanceQuery { nearest_only: true, ..all(body(1), None) };
    assert_eq!(ask(&seen, &nearest), found[1..]);
    let none = DistanceQuery { within: -0.1, ..all(body(1), None) };
    assert!(ask(&seen, &none).is_empty(), "nothing overlaps by that much");
    let nan = DistanceQuery { within: f64::NAN, ..near };
    assert!(seen.distances(&nan, &|| false).unwrap_err().to_string().contains("max_distance"));
}

/// Balls of 0.1 m that overlap one of them by 1, 3 and 2 cm, as three robots and as links of one.
#[test]
fn the_nearest_of_what_overlaps_is_the_deepest() {
    let mut world = world(1e-3);
    spawn(&mut world, robot("ball", &ball(0.1, 1.0), at(DVec3::Z), true));
    let ways = [DVec3::X * 0.19, DVec3::Y * 0.17, DVec3::X * -0.18];
    for (index, way) in ways.into_iter().enumerate() {
        spawn(&mut world, robot(&format!("other-{index}"), &ball(0.1, 1.0), at(DVec3::Z + way), true));
    }
    let together = ways.map(|way| (at(way), Geometry::Sphere { radius: 0.1 }));
    spawn(&mut world, robot("together", &solid(&together, 1.0), at(DVec3::Z), true));
    let seen = look(&world);
    for other in [None, Some(body(4))] {
        let nearest = DistanceQuery { nearest_only: true, ..all(body(0), other) };
        let found = ask(&seen, &nearest);
        assert!(found.len() == 1 && (found[0].distance + 0.03).abs() < 1e-9, "{found:?}");
        let deep = ask(&seen, &DistanceQuery { within: -0.025, ..nearest });
        assert_eq!(deep, found, "bounds of what overlaps are never apart by less than nothing");
    }
}

/// The lowest point of a cylinder tilted by a is r sin a + l / 2 cos a below its middle. The height above a
/// tilted plane counts along its normal. Tested in both orders.
#[test]
fn heights_above_a_plane_are_along_its_normal() {
    let (tilt, lean) = (0.3f64, 0.7f64);
    let mut world = world(1e-3);
    let slope = DPose3::from_parts(DVec3::new(0.2, 0.0, 0.1), DQuat::from_rotation_y(tilt));
    spawn(&mut world, robot("slope", &plane(DVec3::Z), slope, true));
    let rod = solid(&[(DPose3::IDENTITY, Geometry::Cylinder { radius: 0.1, length: 0.6 })], 1.0);
    let place = DVec3::new(0.4, 0.5, 2.0);
    spawn(
        &mut world,
        robot("rod", &rod, DPose3::from_parts(place, DQuat::from_rotation_y(tilt + lean)), false),
    );
    let seen = look(&world);
    let normal = DQuat::from_rotation_y(tilt) * DVec3::Z;
    let expected = (place - slope.translation).dot(normal) - 0.1 * lean.sin() - 0.3 * lean.cos();
    for (a, b, sign) in [(0, 1, 1.0), (1, 0, -1.0)] {
        let found = ask(&seen, &all(body(a), Some(body(b))));
        assert!((found[0].distance - expected).abs() < 1e-12, "{found:?} {expected}");
        assert!(found[0].normal.distance(normal * sign) < 1e-12, "{found:?}");
        let between = (found[0].points[1] - found[0].points[0]).dot(found[0].normal);
        assert!((between - expected).abs() < 1e-12, "{found:?}");
    }
}

/// A planner asks for joint positions that differ from the robot's: the world itself stays the same.
#[test]
fn a_configuration_that_a_robot_is_not_in_is_measured_as_if_it_were_there() {
    let mut model = chain(4);
    for (i, joint) in model.joints.iter_mut().enumerate() {
        joint.parent_from_joint = at(DVec3::X * 0.3);
        joint.axis = [DVec3::Y, DVec3::Z, DVec3::X][i % 3];
    }
    for link in &mut model.links {
        link.collisions = cuboid(DVec3::new(0.2, 0.1, 0.05), 1.0).links[0].collisions.clone();
    }
    let model = Arc::new(model);
    let mut world = scene();
    let shapes = Arc::new(simd_core::collision::Shapes::new(&model));
    let arm =
        simd_core::simulation::command::Spawn { name: "arm".into(), shapes, ..passive(&model, true, &[]) };
    spawn(&mut world, arm);
    let seen = look(&world);
    let index = seen.entity("arm").unwrap().0;
    let count = seen.world.entities[index].positions.len();
    let positions: Vec<f64> = (0..count).map(|i| 0.3 - 0.2 * i as f64).collect();
    let root = DPose3::from_parts(DVec3::new(0.1, 0.2, 0.3), DQuat::from_rotation_z(0.4));
    let configuration = Configuration { root, positions: positions.clone(), ..Configuration::default() };
    let asked = QueryBody { configuration: Some(configuration), ..body(index) };
    let planned = ask(&seen, &all(asked.clone(), None));
    let own = ask(&seen, &all(asked.clone(), Some(asked)));

    apply(&mut world, Command::SetEntityState { robot: "arm".into(), pose: Some(root), twist: None });
    let joints = model.joints.iter().zip(&positions);
    let joints = joints.map(|(joint, position)| simd_core::simulation::command::JointReset {
        joint: joint.name.clone(),
        axis: 0,
        position: *position,
        velocity: 0.0,
        ..Default::default()
    });
    let robots =
        vec![simd_core::simulation::command::RobotReset { robot: "arm".into(), joints: joints.collect() }];
    apply(&mut world, Command::ResetJoints { robots });
    let there = look(&world);
    assert_eq!(ask(&there, &all(body(index), None)), planned);
    assert!(planned.len() >= 3 * count);
    // The same robot twice: as two robots at one place, each link overlaps itself.
    assert!(own.iter().any(|pair| pair.links[0] == pair.links[1] && pair.distance < 0.0));
}

/// A shape without a robot is measured like a robot of that shape, and relative to others of its kind, which
/// have no names.
#[test]
fn a_shape_of_no_robot_is_measured() {
    let mut world = scene();
    let before = look(&world);
    let pose = DPose3::from_parts(DVec3::new(-0.7, 0.3, 1.2), DQuat::from_rotation_x(0.4));
    let capsule = Geometry::Capsule { radius: 0.1, length: 0.5 };
    let query = |a: QuerySide, b: Option<QuerySide>| DistanceQuery { a, b, ..all(body(0), None) };
    let shape = || QuerySide::Shape(capsule.clone(), pose);
    let found = ask(&before, &query(shape(), None));
    assert!(found.iter().all(|pair| pair.robots[0].is_empty() && pair.links[0].is_empty()), "{found:?}");
    let model = solid(&[(DPose3::IDENTITY, capsule.clone())], 1.0);
    spawn(&mut world, robot("capsule", &model, pose, true));
    let there = ask(&look(&world), &all(body(3), None));
    let measured = |pairs: &[DistanceReport]| {
        pairs.iter().map(|pair| (pair.robots[1].clone(), pair.distance)).collect::<Vec<_>>()
    };
    assert_eq!(measured(&found), measured(&there));
    assert_eq!(found.len(), 3);
    let beside = QuerySide::Shape(Geometry::Sphere { radius: 0.2 }, at(pose.translation + 2.0 * DVec3::X));
    let pair = ask(&before, &query(shape(), Some(beside)));
    assert!(pair.len() == 1 && (pair[0].distance - 1.7).abs() < 1e-9, "{pair:?}");
    assert_eq!(pair[0].robots, [String::new(), String::new()]);
    let turned = DPose3 { translation: DVec3::NAN, ..pose };
    let refused = before.distances(&query(QuerySide::Shape(capsule, turned), None), &|| false).unwrap_err();
    assert!(refused.to_string().contains("a.pose.position"), "{refused}");
}

/// Even if one is on the axis of the other, and no side is nearer than another.
#[test]
fn round_shapes_on_one_axis_are_as_deep_inside_each_other_as_beside_it() {
    let world = look(&scene());
    let capsule = |radius, length| Geometry::Capsule { radius, length };
    let cylinder = |radius, length| Geometry::Cylinder { radius, length };
    let cone = Geometry::Cone { radius: 0.1, length: 1.0 };
    for (a, b, up, depth) in [
        (capsule(0.1, 1.0), capsule(0.05, 0.1), 0.0, 0.15),
        (capsule(0.1, 1.0), capsule(0.05, 0.1), 0.2, 0.15),
        (cylinder(0.1, 1.0), capsule(0.05, 0.1), 0.0, 0.15),
        (cylinder(0.1, 1.0), cylinder(0.01, 1.0), 0.0, 0.11),
        (cylinder(0.1, 1.0), cylinder(0.01, 1.0), 0.1, 0.11),
        (cylinder(0.1, 1.0), Geometry::Sphere { radius: 0.01 }, 0.2, 0.11),
        // Out through its lateral surface, whose slope is 0.1.
        (cone, capsule(0.01, 0.02), 0.0, 0.05 * 0.995 + 0.01 + 0.001),
    ] {
        let place = |z: f64, turn: f64| {
            DPose3::from_parts(DVec3::new(5.0, 3.0, 2.0), DQuat::from_rotation_y(turn))
                * DPose3::from_translation(DVec3::Z * z)
        };
        for turn in [0.0, 0.7] {
            let [one, other] =
                [QuerySide::Shape(a.clone(), place(0.0, turn)), QuerySide::Shape(b.clone(), place(up, turn))];
            let found = ask(&world, &DistanceQuery { a: one, b: Some(other), ..all(body(0), None) });
            let [pair] = &found[..] else { panic!("{found:?}") };
            assert!(
                (pair.distance + depth).abs() < 0.01 * depth,
                "{a:?} {b:?} {up} {turn}: {}",
                pair.distance
            );
        }
    }
}

/// Neighbours are left out on request, and so are disabled pairs and groups that do not collide.
#[test]
fn filtered_pairs_are_left_out_on_request() {
    let mut world = scene();
    let pairs = |world: &Simulation| {
        let query = DistanceQuery { filtered: true, ..all(body(1), None) };
        ask(&look(world), &query).into_iter().map(|pair| pair.robots[1].clone()).collect::<Vec<_>>()
    };
    assert_eq!(pairs(&world), ["ground", "box"]);
    let pair = CollisionPair {
        link: "body".into(),
        other_robot: "box".into(),
        other_link: "body".into(),
        enabled: Some(false),
    };
    apply(
        &mut world,
        Command::SetCollisionFilter(CollisionFilterChange {
            robot: "ball".into(),
            self_collision: None,
            pairs: vec![pair],
        }),
    );
    assert_eq!(pairs(&world), ["ground"]);
    let links = vec![LinkProperties {
        collision_group: Some(0),
        collision_mask: Some(0),
        ..LinkProperties::default()
    }];
    apply(&mut world, Command::SetLinkProperties { robot: "ball".into(), links, stays_awake: None });
    assert!(pairs(&world).is_empty());
    assert_eq!(ask(&look(&world), &all(body(1), None)).len(), 2);
}

#[test]
fn shapes_overlap_exactly_or_by_their_boxes() {
    let seen = look(&scene());
    let overlaps = |geometry: &Geometry, pose: DPose3, bounds_only: bool| {
        let found = seen.overlaps(geometry, pose, bounds_only, &|| false).unwrap();
        found.into_iter().map(|(robot, _)| robot).collect::<Vec<_>>()
    };
    // A corner of its box reaches the ball's box, and neither surface the other.
    let near = at(DVec3::new(-0.18, 0.18, 1.0));
    let sphere = Geometry::Sphere { radius: 0.1 };
    assert!(overlaps(&sphere, near, false).is_empty());
    assert_eq!(overlaps(&sphere, near, true), ["ball"]);
    let wide = Geometry::Box { size: DVec3::new(1.0, 0.1, 3.0) };
    assert_eq!(overlaps(&wide, at(DVec3::Z), false), ["ground", "ball", "box"]);
    // A cylinder along z, and one turned along x.
    let rod = Geometry::Cylinder { radius: 0.01, length: 0.9 };
    assert_eq!(overlaps(&rod, at(DVec3::Z), false), ["ball"]);
    let turned = DPose3::from_parts(DVec3::Z, DQuat::from_rotation_y(FRAC_PI_2));
    assert_eq!(overlaps(&rod, turned, false), ["ball", "box"]);
    let nan = at(DVec3::new(f64::NAN, 0.0, 0.0));
    assert!(
        seen.overlaps(&sphere, nan, false, &|| false).unwrap_err().to_string().contains("pose.position.x")
    );
    assert!(seen.overlaps(&wide, DPose3::IDENTITY, false, &|| true).unwrap().is_empty(), "it was given up");
}

#[test]
fn bounds_are_those_of_all_shapes_of_a_link() {
    let mut world = scene();
    let ball = Geometry::Sphere { radius: 0.1 };
    let two = solid(&[(at(DVec3::X), ball.clone()), (at(-DVec3::X), ball)], 1.0);
    let turn = DQuat::from_rotation_z(FRAC_PI_2);
    spawn(&mut world, robot("two", &two, DPose3::from_parts(DVec3::Z * 5.0, turn), false));
    let seen = look(&world);
    let [(link, [lower, upper])] = &seen.link_bounds(3)[..] else { panic!("one link") };
    assert_eq!(link, "body");
    assert!(lower.distance(DVec3::new(-0.1, -1.1, 4.9)) < 1e-12, "{lower}");
    assert!(upper.distance(DVec3::new(0.1, 1.1, 5.1)) < 1e-12, "{upper}");
    assert!(seen.link_bounds(0).is_empty(), "a plane has none");
    assert!(seen.link_bounds(9).is_empty());
}

/// A ball of 0.1 m that starts 0.9 m in front of the face of the box moves 0.8 m of its 1 m.
#[test]
fn a_shape_is_cast_until_it_touches() {
    let seen = look(&scene());
    let sphere = Geometry::Sphere { radius: 0.1 };
    let cast = |from: DVec3, way: DVec3| seen.cast_shape(&sphere, at(from), way, &|| false).unwrap();
    let hit = cast(DVec3::new(1.5, 0.0, 1.0), -DVec3::X).unwrap();
    assert_eq!((&*hit.robot, &*hit.link), ("box", "body"));
    assert!((hit.fraction - 0.8).abs() < 1e-6, "{hit:?}");
    assert!(hit.point.distance(DVec3::new(0.6, 0.0, 1.0)) < 1e-5, "{hit:?}");
    assert!(hit.normal.distance(DVec3::X) < 1e-5, "{hit:?}");
    let down = cast(DVec3::new(3.0, 0.0, 2.1), DVec3::Z * -4.0).unwrap();
    assert!(down.robot == "ground" && (down.fraction - 0.5).abs() < 1e-6, "{down:?}");
    assert_eq!(cast(DVec3::new(3.0, 0.0, 2.0), DVec3::X), None);
    let inside = cast(DVec3::Z, DVec3::X).unwrap();
    assert_eq!((&*inside.robot, inside.fraction), ("ball", 0.0));
    assert!(seen.cast_shape(&sphere, DPose3::IDENTITY, DVec3::splat(f64::NAN), &|| false).is_err());
}

/// A leaning box comes down obliquely on ground 2 cm below its lowest corner. The corner hits the ground
/// below its position at that time, and not below its start. On a path of 500 m the two are 2.7 cm apart. The
/// same on a box, a mesh and the hull of one.
#[test]
fn a_hit_at_the_start_of_a_long_path_is_where_it_touches() {
    let pose = DPose3::from_parts(
        DVec3::new(0.3, -0.2, 1.0),
        DQuat::from_rotation_x(0.6) * DQuat::from_rotation_y(0.5),
    );
    let size = DVec3::new(0.4, 0.3, 0.2);
    let corner = |i: u32| {
        let side = |axis: u32| if i >> axis & 1 == 0 { -0.5 } else { 0.5 };
        pose.transform_point(size * DVec3::new(side(0), side(1), side(2)))
    };
    let lowest = (0..8).map(corner).min_by(|a, b| a.z.total_cmp(&b.z)).unwrap();
    let top = lowest.z - 0.02;
    let flat = grid(3, 8.0, || 0.0, |_, _| 0.0);
    let block = cuboid(DVec3::new(8.0, 8.0, 1.0), 1.0);
    let hull = {
        let corner = |i: u32| {
            let side = |axis: u32| if i >> axis & 1 == 0 { -4.0 } else { 4.0 };
            DVec3::new(side(0), side(1), side(2))
        };
        mesh((0..8).map(corner).collect(), vec![[0, 1, 2], [5, 6, 7]], None, DVec3::ONE)
    };
    let raised = |mut spawn: Spawn, z: f64| {
        spawn.pose = at(DVec3::Z * (top - z));
        spawn
    };
    for floor in [
        raised(ground(&flat), 0.0),
        raised(robot("ground", &block, DPose3::IDENTITY, true), 0.5),
        raised(robot("ground", &hull, DPose3::IDENTITY, true), 4.0),
    ] {
        let mut world = world(1e-3);
        spawn(&mut world, floor);
        let seen = look(&world);
        for length in [1.0, 100.0, 500.0] {
            let way = DVec3::new(0.8, 0.0, -0.6) * length;
            let hit = seen.cast_shape(&Geometry::Box { size }, pose, way, &|| false).unwrap().unwrap();
            let met = lowest + way * (0.02 / (0.6 * length));
            assert!((hit.fraction * length - 0.02 / 0.6).abs() < 1e-6, "{length} m: {hit:?}");
            assert!(hit.point.distance(met) < 1e-5, "{length} m: {hit:?} {met}");
            assert!(hit.normal.distance(DVec3::Z) < 1e-5, "{length} m: {hit:?}");
        }
    }
}
