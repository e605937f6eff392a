//! Many shapes, rays and names in one question.

use glamx::{DPose3, DVec3};
use simd_core::simulation::command::LinkProperties;
use simd_core::simulation::queries::DistanceQuery;
use simd_core::{Command, Simulation};
use simd_model::robot::Geometry;
use simd_tests::scenes::{apply, ball, cuboid, look, robot, solid, spawn, world};

use crate::queries::{all, ask, at, body, scene};

/// Two hundred boxes in pairs, with their upper sides in one plane. A ray's hit is the first of the robots
/// hit at that place, whatever tree was built.
#[test]
fn the_first_robot_counts_among_hits_at_one_place() {
    let mut world = world(1e-3);
    let tile = cuboid(DVec3::new(1.0, 1.0, 0.1), 1.0);
    // Spawned in another order than their cells.
    let cells: Vec<usize> = (0..200).map(|i| (i * 73) % 100).collect();
    for (i, cell) in cells.iter().enumerate() {
        let x = DVec3::new((cell % 10) as f64, (cell / 10) as f64, 0.0);
        spawn(&mut world, robot(&format!("tile-{i}"), &tile, at(x), true));
    }
    let seen = look(&world);
    let mut rays = Vec::new();
    for x in 0..19 {
        for y in 0..19 {
            // Within tiles and on their edges.
            let over = DVec3::new(f64::from(x) * 0.5, f64::from(y) * 0.5, 2.0);
            rays.push([over, over - DVec3::Z * 4.0]);
        }
    }
    let hits = seen.cast_rays(&rays, None, &|| false).unwrap();
    for ([from, _], hit) in rays.iter().zip(&hits) {
        let covers = |cell: &usize| {
            let (x, y) = ((cell % 10) as f64, (cell / 10) as f64);
            (from.x - x).abs() <= 0.5 && (from.y - y).abs() <= 0.5
        };
        let first = cells.iter().position(covers).unwrap();
        assert_eq!(hit.as_ref().unwrap().robot, format!("tile-{first}"), "{from}");
    }
}

#[test]
fn rays_are_masked_by_groups_and_bounded_by_their_names() {
    let mut world = scene();
    let down = vec![[DVec3::Z * 2.0, DVec3::ZERO - DVec3::Z]];
    let hit = |world: &Simulation, mask| {
        let hits = look(world).cast_rays(&down, mask, &|| false).unwrap();
        hits[0].as_ref().map(|hit| hit.robot.clone())
    };
    let links = vec![LinkProperties { collision_group: Some(6), ..LinkProperties::default() }];
    apply(&mut world, Command::SetLinkProperties { robot: "ball".into(), links, stays_awake: None });
    assert_eq!(hit(&world, None).as_deref(), Some("ball"));
    assert_eq!(hit(&world, Some(4)).as_deref(), Some("ball"));
    assert_eq!(hit(&world, Some(1)).as_deref(), Some("ground"));
    assert_eq!(hit(&world, Some(8)), None);

    let long = "a".repeat(1_000);
    spawn(&mut world, robot(&long, &ball(0.1, 1.0), at(DVec3::new(0.0, 0.0, 1.5)), false));
    let seen = look(&world);
    assert!(seen.cast_rays(&vec![down[0]; 1_000], None, &|| false).is_ok());
    let refused = seen.cast_rays(&vec![down[0]; 20_000], None, &|| false).unwrap_err().to_string();
    assert!(refused.contains("the size of the answer in bytes"), "{refused}");
}

/// Four hundred balls in a square above as many are 160,000 pairs; each is 0.98 m above the nearest.
#[test]
fn the_nearest_of_more_pairs_than_are_measured_is_found_by_their_bounds() {
    let mut world = world(1e-3);
    let ball = |i: i32| {
        let place = DVec3::new(0.1 * f64::from(i % 20), 0.1 * f64::from(i / 20), 0.0);
        (at(place), Geometry::Sphere { radius: 0.01 })
    };
    let square = solid(&(0..400).map(ball).collect::<Vec<_>>(), 1.0);
    spawn(&mut world, robot("lower", &square, DPose3::IDENTITY, true));
    spawn(&mut world, robot("upper", &square, at(DVec3::Z), true));
    let seen = look(&world);
    let every = all(body(0), Some(body(1)));
    let refused = seen.distances(&every, &|| false).unwrap_err().to_string();
    assert!(refused.contains("max_distance") && refused.contains("100000"), "{refused}");
    let found = ask(&seen, &DistanceQuery { nearest_only: true, ..every.clone() });
    assert!(found.len() == 1 && (found[0].distance - 0.98).abs() < 1e-9, "{found:?}");
    let near = ask(&seen, &DistanceQuery { within: 0.981, ..every });
    assert!(near.len() == 1 && (near[0].distance - 0.98).abs() < 1e-9, "{near:?}");
}

#[test]
fn bounds_of_many_links_are_bounded_by_their_names() {
    let mut world = scene();
    let long = "a".repeat(1_000);
    spawn(&mut world, robot(&long, &ball(0.1, 1.0), at(DVec3::new(0.0, 0.0, 9.0)), false));
    let seen = look(&world);
    let some = seen.bounds_of(&[1, 3], &|| false).unwrap();
    assert_eq!(some.iter().map(|(robot, _)| &**robot).collect::<Vec<_>>(), ["ball", &*long]);
    assert_eq!(some[0].1, seen.link_bounds(1)[0]);
    assert!(seen.bounds_of(&[3], &|| true).unwrap().is_empty(), "it was given up");
    let refused = seen.bounds_of(&[3; 5_000], &|| false).unwrap_err().to_string();
    assert!(refused.contains("the size of the answer in bytes"), "{refused}");
}
