//! Shapes that are cast at meshes of triangles and at height fields.

use std::cell::Cell;
use std::f64::consts::SQRT_2;

use fastrand::Rng;
use glamx::{DPose3, DQuat, DVec3};
use simd_core::PublishedState;
use simd_core::simulation::command::Spawn;
use simd_core::simulation::rays::RayReport;
use simd_model::robot::Geometry;
use simd_tests::scenes::{look, spawn, world};

use crate::grounds::{field, grid, ground};

const BALL: Geometry = Geometry::Sphere { radius: 0.1 };

/// Returns a world of this ground.
fn of(floor: Spawn) -> PublishedState {
    let mut world = world(1e-3);
    spawn(&mut world, floor);
    look(&world)
}

fn cast(seen: &PublishedState, from: DVec3, way: DVec3) -> Option<RayReport> {
    seen.cast_shape(&BALL, DPose3::from_translation(from), way, &|| false).unwrap()
}

/// Returns a ridge along y, 3 m high, with sides of 45 degrees on flat ground.
fn ridge(x: f64, _: f64) -> f64 {
    (3.0 - x.abs()).max(0.0)
}

/// The ridge's corners are on those of the grids, so that its sides are planes. The middle of a ball of
/// radius r at the height of 1 m is r from one of them at x = -2 - r sqrt(2). A cast of parry is right to
/// 1e-6 of the path. Its point of contact is right to a centimetre, since it moves far along a surface before
/// its distance changes. The last part is computed again.
#[test]
fn a_ball_that_is_cast_along_the_ground_stops_at_a_ridge() {
    for floor in [ground(&grid(80, 20.0, || 0.0, ridge)), ground(&field(81, 20.0, ridge))] {
        let seen = of(floor);
        for (side, far) in [(-1.0, 8.0), (1.0, 8.0), (-1.0, 300.0), (1.0, 300.0)] {
            let expected = (far - 2.0 - 0.1 * SQRT_2) / (2.0 * far);
            let (from, way) = (DVec3::new(far * side, 0.1, 1.0), DVec3::X * (-2.0 * far * side));
            let hit = cast(&seen, from, way).unwrap();
            assert!((hit.fraction - expected).abs() < 1e-8, "{hit:?} {expected}");
            let normal = DVec3::new(side, 0.0, 1.0) / SQRT_2;
            assert!(hit.normal.distance(normal) < 1e-4, "{hit:?}");
            assert!(hit.point.distance(from + way * expected - normal * 0.1) < 1e-4, "{hit:?}");
        }
        assert_eq!(cast(&seen, DVec3::new(-8.0, 0.1, 3.2), DVec3::X * 16.0), None, "above it");
        let down = cast(&seen, DVec3::new(6.1, 0.1, 4.1), DVec3::Z * -8.0).unwrap();
        assert!((down.fraction - 0.5).abs() < 1e-6, "{down:?}");
        assert!(down.point.distance(DVec3::new(6.1, 0.1, 0.0)) < 1e-5, "{down:?}");
        assert!(down.normal.distance(DVec3::Z) < 1e-5, "{down:?}");
        assert_eq!(cast(&seen, DVec3::new(6.1, 0.1, 4.1), DVec3::Z * -3.9), None, "the way is too short");
    }
}

/// A shape that is a millimetre smaller overlaps nothing up to the hit, or anywhere if there is none. One
/// that is a millimetre larger overlaps at the hit.
#[test]
fn a_shape_that_is_cast_stops_where_it_begins_to_overlap() {
    let mut rng = Rng::with_seed(12);
    let bumps = |x: f64, y: f64| 0.5 * (1.3 * x).sin() * (0.9 * y).cos();
    let turn = DQuat::from_rotation_z(0.7) * DQuat::from_rotation_x(0.2);
    let place = DPose3::from_parts(DVec3::new(0.3, -0.2, 0.5), turn);
    for floor in [ground(&grid(30, 8.0, || 0.0, bumps)), ground(&field(31, 8.0, bumps))] {
        let seen = of(Spawn { pose: place, ..floor });
        let mut hits = 0;
        for i in 0..200 {
            let mut over = |height: f64| {
                place.transform_point(DVec3::new(6.0 * rng.f64() - 3.0, 6.0 * rng.f64() - 3.0, height))
            };
            // A start above all bumps may end below them.
            let (from, to) = (over(0.9), over(0.1 * f64::from(i % 10) - 0.4));
            let rotation = DQuat::from_rotation_x(6.0 * rng.f64()) * DQuat::from_rotation_z(6.0 * rng.f64());
            let size = DVec3::new(0.1 + 0.2 * rng.f64(), 0.1 + 0.2 * rng.f64(), 0.1);
            let larger = |by: f64| match i % 2 {
                0 => Geometry::Sphere { radius: 0.1 + by },
                _ => Geometry::Box { size: size + DVec3::splat(2.0 * by) },
            };
            let pose = |fraction: f64| DPose3::from_parts(from + (to - from) * fraction, rotation);
            let overlaps = |by: f64, fraction: f64| {
                !seen.overlaps(&larger(by), pose(fraction), false, &|| false).unwrap().is_empty()
            };
            let hit = seen.cast_shape(&larger(0.0), pose(0.0), to - from, &|| false).unwrap();
            let end = hit.as_ref().map_or(1.0, |hit| hit.fraction);
            let mut passed = (0..100).map(|part| end * f64::from(part) / 100.0);
            let through = passed.find(|fraction| overlaps(-1e-3, *fraction));
            assert_eq!(through, None, "{i}: {hit:?}");
            if hit.is_some() {
                hits += 1;
                assert!(overlaps(1e-3, end), "{i}: {hit:?}");
            }
        }
        assert!((50..200).contains(&hits), "{hits}");
    }
}

/// A path of a thousand million kilometres leaves the grid at once, and a plate of that size is above each of
/// its 80,000 triangles. The work depends on the cells below; once in 256 triangles the callback decides
/// whether to continue.
#[test]
fn a_cast_is_as_much_work_as_the_cells_below_it() {
    let seen = of(ground(&field(201, 20.0, ridge)));
    let asked = Cell::new(0);
    let count = || {
        asked.set(asked.get() + 1);
        false
    };
    let at = |x: f64, z: f64| DPose3::from_translation(DVec3::new(x, 0.05, z));
    let beyond = seen.cast_shape(&BALL, at(0.0, 3.5), DVec3::new(1e12, 0.0, -1.0), &count).unwrap();
    assert_eq!(beyond, None);
    let hit = seen.cast_shape(&BALL, at(-8.0, 1.0), DVec3::X * 1e12, &count).unwrap().unwrap();
    assert!((hit.fraction * 1e12 - (6.0 - 0.1 * SQRT_2)).abs() < 1e-4, "{hit:?}");
    assert!(asked.get() < 100, "{}", asked.get());
    // The place of the hit is not compared: its corners are too far away to be exact.
    let plate = Geometry::Box { size: DVec3::new(1e12, 1e12, 0.1) };
    let way = DVec3::new(1.0, 0.0, -5.0);
    assert!(seen.cast_shape(&plate, at(0.0, 5.0), way, &count).is_ok());
    assert!(asked.get() < 1_000, "{}", asked.get());
    assert_eq!(seen.cast_shape(&BALL, at(-8.0, 1.0), DVec3::X * 16.0, &|| true).unwrap(), None, "given up");
}

#[test]
fn a_shape_below_a_height_field_is_hit_at_the_start_and_the_ground_from_the_side() {
    let slope = 0.2;
    let seen = of(ground(&field(50, 4.0, |x, _| slope * x)));
    let normal = DVec3::new(-slope, 0.0, 1.0).normalize();
    for way in [DVec3::X, DVec3::Z, -DVec3::Z, DVec3::ZERO] {
        // In the ground, and on it.
        for height in [-1.5, 0.29] {
            let hit = cast(&seen, DVec3::new(1.0, 0.3, height), way * 2.0).unwrap();
            assert_eq!((&*hit.robot, hit.fraction), ("ground", 0.0));
            assert!((hit.point.z - slope * hit.point.x).abs() < 1e-6, "{hit:?}");
            assert!(hit.normal.distance(normal) < 1e-6, "{hit:?}");
        }
    }
    // It is in the ground as soon as its middle is: at the border of the field, x = 2.
    let beside = cast(&seen, DVec3::new(5.0, 0.3, -1.0), DVec3::X * -4.0).unwrap();
    assert!((beside.fraction - 0.75).abs() < 1e-9, "{beside:?}");
    assert!(beside.point.distance(DVec3::new(2.0, 0.3, -1.0)) < 1e-9, "{beside:?}");
    assert!(beside.normal.distance(DVec3::X) < 1e-9, "{beside:?}");
    assert_eq!(cast(&seen, DVec3::new(5.0, 0.3, 1.0), DVec3::X * -4.0), None, "above it");
    assert_eq!(cast(&seen, DVec3::new(5.0, 0.3, -1.0), DVec3::X * -2.0), None, "not up to it");
}

#[test]
fn a_shape_or_a_way_that_is_too_large_is_refused_by_its_field() {
    let seen = of(ground(&field(3, 4.0, |_, _| 0.0)));
    let pose = DPose3::from_translation(DVec3::Z);
    let refusal =
        |shape: &Geometry, way: DVec3| seen.cast_shape(shape, pose, way, &|| false).unwrap_err().to_string();
    let way = refusal(&BALL, DVec3::new(1e15, 0.0, -1.0));
    assert!(way.starts_with("translation.x is ") && way.contains("1e12"), "{way}");
    assert!(refusal(&BALL, DVec3::Y * f64::NAN).starts_with("translation.x is NaN"));
    for (shape, field) in [
        (Geometry::Sphere { radius: 2e12 }, "shape.sphere.radius"),
        (Geometry::Box { size: DVec3::new(1.0, 1.0, 1e200) }, "shape.box.size.z"),
        (Geometry::Cylinder { radius: 1.0, length: 1e13 }, "shape.cylinder.length"),
        (Geometry::Capsule { radius: 1e13, length: 1.0 }, "shape.capsule.radius"),
        (Geometry::Cone { radius: 1e13, length: 1.0 }, "shape.cone.radius"),
    ] {
        let cast = refusal(&shape, DVec3::X);
        assert!(cast.starts_with(field), "{cast}");
        let overlap = seen.overlaps(&shape, pose, false, &|| false).unwrap_err().to_string();
        assert!(overlap.starts_with(field), "{overlap}");
    }
    // So are places, of rays too.
    let far = DVec3::new(0.0, f64::MAX, 0.0);
    let pose = DPose3::from_translation(far);
    let cast = seen.cast_shape(&BALL, pose, DVec3::X, &|| false).unwrap_err().to_string();
    let overlap = seen.overlaps(&BALL, pose, false, &|| false).unwrap_err().to_string();
    assert!(cast.starts_with("pose.position.y is ") && overlap.starts_with("pose.position.y is "), "{cast}");
    let ray = seen.cast_rays(&[[DVec3::ZERO, far]], None, &|| false).unwrap_err().to_string();
    assert!(ray.starts_with("rays[0].to.y is "), "{ray}");
}

#[test]
fn a_shape_that_does_not_move_meets_what_it_overlaps() {
    let seen = of(ground(&grid(80, 20.0, || 0.0, ridge)));
    for way in [DVec3::ZERO, DVec3::X * 1e-300] {
        let hit = cast(&seen, DVec3::new(6.1, 0.1, 0.05), way).unwrap();
        assert_eq!(hit.fraction, 0.0, "{hit:?}");
        assert_eq!(cast(&seen, DVec3::new(6.1, 0.1, 0.2), way), None);
    }
}
