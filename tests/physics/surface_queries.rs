//! Queries on triangle meshes and height fields, and their amount of work.

use simd_tests::world::at;
use std::cell::Cell;
use std::f64::consts::FRAC_PI_4;
use std::sync::atomic::AtomicU64;
use std::sync::atomic::Ordering::Relaxed;

use fastrand::Rng;
use glamx::{DPose3, DQuat, DVec3};
use simd_core::simulation::command::Spawn;
use simd_core::simulation::queries::{DistanceQuery, DistanceReport, QueryBody};
use simd_core::{Command, PublishedState};
use simd_model::robot::Geometry;
use simd_tests::scenes::*;

use crate::grounds::{field, grid, ground, mesh};

fn between(a: usize, b: usize) -> DistanceQuery {
    let body = |robot| QueryBody { robot, link: None, configuration: None };
    let (a, b) = (body(a).into(), Some(body(b).into()));
    DistanceQuery { a, b, within: f64::INFINITY, nearest_only: false, filtered: false }
}

/// Asks, and counts the calls of the callback that decides whether to continue.
fn ask(seen: &PublishedState, query: &DistanceQuery) -> (Vec<DistanceReport>, u32) {
    let asked = Cell::new(0);
    let found = seen.distances(query, &|| {
        asked.set(asked.get() + 1);
        false
    });
    (found.unwrap(), asked.get())
}

/// Returns the same slope as a mesh and as a height field.
fn slopes(cells: usize, slope: f64) -> [Spawn; 2] {
    let size = 20.0;
    let height = |x: f64, _: f64| slope * x;
    [ground(&grid(cells, size, || 0.0, height)), ground(&field(cells + 1, size, height))]
}

/// A ball above a slope: (z - s x) / sqrt(1 + s^2) - r. A box above it: its lowest corner. Half a million
/// triangles are not examined one by one: the callback is called once in a thousand of them.
#[test]
fn the_distance_from_a_slope_of_half_a_million_triangles_is_that_from_its_plane() {
    let slope = 0.5f64;
    let normal = DVec3::new(-slope, 0.0, 1.0).normalize();
    for floor in slopes(500, slope) {
        for (x, z) in [(0.3, 0.2), (-2.1, 3.0), (4.0, 700.0)] {
            let mut world = world(1e-3);
            spawn(&mut world, floor.clone());
            let place = DVec3::new(x, 0.7, z + slope * x);
            spawn(&mut world, robot("ball", &ball(0.1, 1.0), DPose3::from_translation(place), false));
            let turned =
                DPose3::from_parts(place, DQuat::from_rotation_y(FRAC_PI_4) * DQuat::from_rotation_z(1.0));
            let size = DVec3::new(0.1, 0.2, 0.05);
            spawn(&mut world, robot("box", &cuboid(size, 1.0), turned, false));
            let seen = look(&world);
            let corner = |i: u32| {
                let side = |axis: u32| if i >> axis & 1 == 0 { -0.5 } else { 0.5 };
                turned.transform_point(size * DVec3::new(side(0), side(1), side(2))).dot(normal)
            };
            let lowest = (0..8).map(corner).fold(f64::INFINITY, f64::min);
            for (body, expected) in [(1, place.dot(normal) - 0.1), (2, lowest)] {
                let (found, asked) = ask(&seen, &between(body, 0));
                assert_eq!(found.len(), 1);
                let DistanceReport { points, normal: way, distance, .. } = &found[0];
                // If the foot of the perpendicular is beyond the edge, the distance is larger.
                if z < 100.0 {
                    assert!((distance - expected).abs() < 1e-9, "{distance} {expected}");
                    assert!(way.distance(-normal) < 1e-6, "{way}");
                } else {
                    assert!(*distance >= expected - 1e-9, "{distance} {expected}");
                }
                assert!((points[0].distance(points[1]) - distance).abs() < 1e-9, "{found:?}");
                assert!(asked < 100, "{asked}");
            }
        }
    }
}

/// The least of the distances from all triangles one by one, as boxes have them.
#[test]
fn the_distance_from_rough_ground_is_that_from_its_nearest_triangle() {
    let mut rng = Rng::with_seed(8);
    let bumps = |x: f64, y: f64| 0.3 * (4.0 * x).sin() * (3.0 * y).cos();
    let floors = [ground(&grid(20, 2.0, || 0.0, bumps)), ground(&field(21, 2.0, bumps))];
    for floor in floors {
        let mut world = world(1e-3);
        spawn(&mut world, floor);
        for i in 0..60 {
            let turn = DQuat::from_rotation_x(6.0 * rng.f64()) * DQuat::from_rotation_z(6.0 * rng.f64());
            let place = DVec3::new(3.0 * rng.f64() - 1.5, 3.0 * rng.f64() - 1.5, 0.5 + 2.0 * rng.f64());
            let size = DVec3::new(0.05 + rng.f64(), 0.05 + 0.3 * rng.f64(), 0.05);
            let pose = DPose3::from_parts(place, turn);
            spawn(&mut world, robot(&format!("body-{i}"), &cuboid(size, 1.0), pose, false));
        }
        let seen = look(&world);
        for body in 1..=60 {
            let (all, _) = ask(&seen, &between(body, 0));
            let nearest = all[0].distance;
            // Nearer surfaces than the given distance are found, and farther ones are not.
            let within = |within: f64| ask(&seen, &DistanceQuery { within, ..between(body, 0) }).0;
            assert!(within(nearest - 1e-6).is_empty(), "{body} {nearest}");
            let found = within(nearest + 1e-6);
            assert!((found[0].distance - nearest).abs() < 1e-9, "{body} {nearest}");
            // No point of the ground's surface is nearer to the box than that.
            let swapped = ask(&seen, &between(0, body)).0;
            assert!((swapped[0].distance - nearest).abs() < 1e-9);
            if nearest > 0.0 {
                let moved = DPose3::from_parts(
                    seen.roots[body].pose.translation + swapped[0].normal * -(nearest - 1e-6),
                    seen.roots[body].pose.rotation,
                );
                let size = seen.link_bounds(body);
                assert!(!size.is_empty());
                let model = &seen.world.entities[body].model.links[0].collisions[0].geometry;
                let clear = seen.overlaps(model, moved, false, &|| false).unwrap();
                assert!(!clear.contains(&("ground".into(), "body".into())), "{body} {nearest}");
                let deeper = DPose3::from_parts(moved.translation - swapped[0].normal * 1e-3, moved.rotation);
                let meets = seen.overlaps(model, deeper, false, &|| false).unwrap();
                assert!(meets.contains(&("ground".into(), "body".into())), "{body} {nearest}");
            }
        }
    }
}

#[test]
fn shapes_in_or_below_a_height_field_overlap_it_and_shapes_above_do_not() {
    let mut world = world(1e-3);
    spawn(&mut world, ground(&field(50, 4.0, |x, _| 0.2 * x)));
    let seen = look(&world);
    let sphere = Geometry::Sphere { radius: 0.1 };
    let named = |pose, bounds_only| seen.overlaps(&sphere, pose, bounds_only, &|| false).unwrap().len();
    assert_eq!(named(at(1.0, 0.3, 0.2 + 0.09), false), 1, "it touches");
    assert_eq!(named(at(1.0, 0.3, 0.2 + 0.12), false), 0, "it is above");
    assert_eq!(named(at(1.0, 0.3, -1.5), false), 1, "it is below");
    assert_eq!(named(at(1.0, 0.3, -1.5), true), 0, "its box does not meet that of the surface");
    assert_eq!(named(at(3.0, 0.3, 0.0), false), 0, "it is beside it");
    spawn(&mut world, robot("sunk", &ball(0.1, 1.0), at(1.0, 0.3, -0.3), false));
    let (found, _) = ask(&look(&world), &between(1, 0));
    let depth = 0.5 / 1.04f64.sqrt() + 0.1;
    assert!((found[0].distance + depth).abs() < 1e-9, "{found:?} {depth}");
}

/// A plate of 0.1 m that lies on level ground, with a hill of 0.095 m nearly through it. For each triangle of
/// the hill the way down would be the shorter one, but the ground is below. A cast that begins there is
/// stopped in the same way.
#[test]
fn a_shape_around_a_hill_is_separated_from_the_ground_upwards() {
    let hill = |x: f64, y: f64| 0.095 - 0.1 * x.hypot(y);
    let plate = Geometry::Box { size: DVec3::new(2.0, 2.0, 0.1) };
    let pose = at(0.8, 0.0, 0.05);
    let mut world = world(1e-3);
    spawn(&mut world, ground(&field(41, 4.0, hill)));
    spawn(&mut world, robot("plate", &solid(&[(DPose3::IDENTITY, plate.clone())], 1.0), pose, false));
    let seen = look(&world);
    for (a, b, up) in [(0, 1, 1.0), (1, 0, -1.0)] {
        let (found, _) = ask(&seen, &between(a, b));
        assert!((found[0].distance + 0.095).abs() < 1e-6, "{found:?}");
        assert!(found[0].normal.distance(DVec3::Z * up) < 1e-6, "{found:?}");
    }
    let hit = seen.cast_shape(&plate, pose, DVec3::X, &|| false).unwrap().unwrap();
    assert_eq!((&*hit.robot, hit.fraction), ("ground", 0.0));
    assert!(hit.normal.distance(DVec3::Z) < 1e-6, "{hit:?}");
}

/// Two meshes of a hundred thousand triangles would be compared for hours.
#[test]
fn the_distance_of_two_surfaces_is_refused_with_what_to_do() {
    let mut world = world(1e-3);
    let [mesh, field] = slopes(200, 0.1);
    spawn(&mut world, mesh);
    spawn(&mut world, Spawn { name: "other".into(), pose: at(0.0, 0.0, 1.0), ..field });
    spawn(&mut world, robot("ball", &ball(0.1, 1.0), at(0.0, 0.0, 0.5), false));
    let seen = look(&world);
    let refused = seen.distances(&between(0, 1), &|| false).unwrap_err().to_string();
    assert!(refused.contains("collision") && refused.contains("hull"), "{refused}");
    let others = DistanceQuery { b: None, ..between(0, 1) };
    let (found, _) = ask(&seen, &others);
    assert_eq!(found.iter().map(|pair| &*pair.robots[1]).collect::<Vec<_>>(), ["ball"]);
}

/// A slab of 90 m on a field of a million samples: the step ends soon after it is interrupted, and has no
/// effect.
#[test]
fn a_step_with_a_large_slab_on_a_large_field_can_be_interrupted() {
    let mut world = world(1e-3);
    let mut rng = Rng::with_seed(4);
    let heights: Vec<f64> = (0..1_000_000).map(|_| 1e-3 * rng.f64()).collect();
    let next = Cell::new(0);
    let rough = |_: f64, _: f64| {
        next.set(next.get() + 1);
        heights[next.get() - 1]
    };
    spawn(&mut world, ground(&field(1_000, 100.0, rough)));
    spawn(&mut world, robot("slab", &cuboid(DVec3::new(90.0, 90.0, 0.2), 1e4), at(0.0, 0.0, 0.1005), false));
    let before = world.fingerprint();
    let asked = AtomicU64::new(0);
    let interrupt = || asked.fetch_add(1, Relaxed) >= 20;
    assert!(!world.step_interruptible(&interrupt));
    assert_eq!(asked.into_inner(), 21);
    assert_eq!(world.fingerprint(), before);
    // The distance query can be interrupted too, and then gives no result.
    apply(
        &mut world,
        Command::SetEntityState {
            robot: "slab".into(),
            pose: Some(DPose3::from_parts(DVec3::Z * 3.0, DQuat::from_rotation_x(0.02))),
            twist: None,
        },
    );
    let seen = look(&world);
    let asked = Cell::new(0);
    let cancelled = || {
        asked.set(asked.get() + 1);
        asked.get() > 2
    };
    assert!(seen.distances(&between(1, 0), &cancelled).unwrap().is_empty());
    assert_eq!(asked.get(), 3);
}

/// Straight down through each corner of the grid and the middle of each edge, where rounding decides whether
/// a triangle is hit.
#[test]
fn no_ray_passes_between_the_triangles_of_a_slope() {
    let (cells, slope, size) = (7, 0.3, 20.0);
    for floor in slopes(cells, slope) {
        let mut world = world(1e-3);
        spawn(&mut world, floor);
        let seen = look(&world);
        let places = (1..2 * cells).map(|i| (i as f64 / (2 * cells) as f64 - 0.5) * size);
        let across: Vec<(f64, f64)> =
            places.clone().flat_map(|x| places.clone().map(move |y| (x, y))).collect();
        let down = |(x, y): &(f64, f64)| [DVec3::new(*x, *y, 50.0), DVec3::new(*x, *y, -50.0)];
        let rays: Vec<[DVec3; 2]> = across.iter().map(down).collect();
        let hits = seen.cast_rays(&rays, None, &|| false).unwrap();
        for ((x, y), hit) in across.iter().zip(&hits) {
            let hit = hit.as_ref().unwrap_or_else(|| panic!("nothing at {x} {y}"));
            assert!((hit.point.z - slope * x).abs() < 1e-7, "{hit:?}");
        }
    }
}

/// A slab of 10 m by 10 m by 0.1 m has an inside, and bodies above or below are not in it. The callback is
/// called for each pair of shapes.
#[test]
fn a_start_inside_of_a_closed_mesh_is_below_its_surface() {
    let corner = |i: u32| {
        let side = |axis: u32| if i >> axis & 1 == 0 { -0.5 } else { 0.5 };
        DVec3::new(10.0 * side(0), 10.0 * side(1), 0.1 * side(2) - 0.05)
    };
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    let mut world = world(1e-3);
    spawn(&mut world, ground(&mesh((0..8).map(corner).collect(), triangles.collect(), None, DVec3::ONE)));
    for (name, pose) in
        [("inside", at(0.5, 0.2, -0.04)), ("below", at(1.0, 0.2, -0.5)), ("above", at(2.0, 0.2, 0.5))]
    {
        spawn(&mut world, robot(name, &ball(0.02, 1.0), pose, false));
    }
    let parts: Vec<_> =
        (0..40).map(|i| (at(0.1 * f64::from(i), 3.2, -0.05), Geometry::Sphere { radius: 0.02 })).collect();
    spawn(&mut world, robot("parts", &solid(&parts, 1.0), DPose3::IDENTITY, false));
    let seen = look(&world);
    let asked = Cell::new(0);
    let count = || {
        asked.set(asked.get() + 1);
        false
    };
    let found = seen.terrain_penetrations(0, DVec3::Z * -9.81, 8, &count);
    let named: Vec<_> = found.iter().map(|it| (&*it.link.0, &*it.terrain.0)).collect();
    assert_eq!(named, [("inside", "ground"), ("parts", "ground")]);
    assert!((found[0].depth - 0.04).abs() < 1e-9 && (found[1].depth - 0.05).abs() < 1e-9, "{found:?}");
    assert!(asked.get() > 40, "{}", asked.get());
}
