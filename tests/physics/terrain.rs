//! Triangle meshes and height fields on which robots stand, roll and slide: compared with a plane, and with
//! impossible results.

use fastrand::Rng;
use glamx::{DPose3, DQuat, DVec3};
use simd_core::simulation::command::Spawn;
use simd_core::{Command, Simulation};
use simd_model::robot::Geometry;
use simd_tests::scenes::*;
use simd_tests::world::at;
use simd_tests::world::run;

use crate::contacts::keep_awake;
use crate::grounds::{field, grid, ground, mesh, stairs};

/// Returns a flat mesh of 1,058 triangles of all shapes, a height field with as many, and a plane at their
/// height. They are a metre up so that no number is round.
fn flat_grounds() -> [(&'static str, Spawn); 3] {
    let mut rng = Rng::with_seed(3);
    let jittered = grid(23, 4.0, || 0.6 * (rng.f64() - 0.5), |_, _| 0.0);
    [
        ("plane", ground(&plane(DVec3::Z))),
        ("mesh", ground(&jittered)),
        ("height field", ground(&field(24, 4.0, |_, _| 0.0))),
    ]
}

/// As on a plane: a ball that rolls at 1.5 m/s over some forty seams, at an angle. Heights to 1e-6 m, the
/// requirement. Velocities to 1e-9 m/s, which is rounding: the rows of a contact are solved to 1e-10.
#[test]
fn a_ball_rolls_over_the_seams_of_a_flat_ground_as_on_a_plane() {
    let (radius, velocity) = (0.1, DVec3::new(1.4, 0.5, 0.0));
    for (name, floor) in flat_grounds() {
        let mut world = world(1e-3);
        spawn(&mut world, floor);
        // The depth of a resting contact: nothing moves it there.
        let start = radius - 1e-5;
        spawn(&mut world, robot("body", &ball(radius, 1.0), at(-1.5, -0.7, start), false));
        throw(&mut world, "body", velocity, DVec3::Z.cross(velocity) / radius);
        // It rolls about a point between the surfaces, a little less than a radius away.
        run(&mut world, 0.05);
        let velocity = look(&world).roots[1].linear;
        let (mut height, mut jump) = (0.0f64, 0.0f64);
        for _ in 0..2_000 {
            world.step();
            let root = look(&world).roots[1].clone();
            height = height.max((root.pose.translation.z - start).abs());
            jump = jump.max((root.linear - velocity).length());
        }
        println!("{name}: height {height:e} m, velocity {jump:e} m/s");
        assert!(height < 1e-6 && jump < 1e-9, "{name}: height {height:e}, velocity {jump:e}");
    }
}

/// v^2 / (2 mu g) on each of them, and as far as on the plane to 1e-4 m: the box has other contact points.
#[test]
fn a_box_slides_over_the_seams_of_a_flat_ground_as_on_a_plane() {
    let (mu, speed, size) = (0.4, 3.0, DVec3::new(0.3, 0.2, 0.1));
    let mut ways = Vec::new();
    for (name, floor) in flat_grounds() {
        let mut world = world(1e-3);
        spawn(&mut world, Spawn { contact_settings: surface(mu, 0.0), ..floor });
        let body = robot("body", &cuboid(size, 2.0), at(-1.5, 0.1, size.z / 2.0), false);
        spawn(&mut world, Spawn { contact_settings: surface(mu, 0.0), ..body });
        throw(&mut world, "body", DVec3::X * speed, DVec3::ZERO);
        keep_awake(&mut world, "body");
        let mut height = 0.0f64;
        for _ in 0..1_500 {
            world.step();
            height = height.max((look(&world).roots[1].pose.translation.z - size.z / 2.0).abs());
        }
        let root = look(&world).roots[1].clone();
        let way = root.pose.translation - DVec3::new(-1.5, 0.1, size.z / 2.0);
        println!("{name}: {way} m, height {height:e}");
        let expected = speed * speed / (2.0 * mu * 9.81);
        assert!((way.x - expected).abs() < 2e-3 * expected && way.y.abs() < 1e-3, "{name}: {way}");
        assert!(height < 1e-4 && root.linear.length() < 1e-6, "{name}: {height}, {}", root.linear);
        ways.push(way.x);
    }
    assert!(ways.iter().all(|way| (way - ways[0]).abs() < 1e-3), "{ways:?}");
}

/// A bowl, which a hull would close: balls come to rest inside, none below its surface, with the lowest at
/// its middle.
#[test]
fn balls_come_to_rest_in_a_bowl() {
    let bowl = |x: f64, y: f64| 0.8 * (x * x + y * y);
    for floor in [ground(&grid(40, 2.0, || 0.0, bowl)), ground(&field(41, 2.0, bowl))] {
        let mut world = world(2e-3);
        spawn(&mut world, Spawn { contact_settings: surface(0.3, 0.0), ..floor });
        let (radius, count) = (0.05, 60);
        for i in 0..count {
            let (layer, index) = (i / 16, i % 16);
            let (x, y) = (0.12 * f64::from(index % 4) - 0.18, 0.12 * f64::from(index / 4) - 0.18);
            let pose = at(x + 0.005 * f64::from(layer), y, 0.4 + 0.12 * f64::from(layer));
            spawn(&mut world, robot(&format!("ball-{i}"), &ball(radius, 0.1), pose, false));
        }
        run(&mut world, 4.0);
        let seen = look(&world);
        let mut lowest = f64::INFINITY;
        for root in &seen.roots[1..] {
            let place = root.pose.translation;
            // Facets lie below the paraboloid they are drawn in by less than 0.8 * 0.05^2 / 4.
            assert!(place.z > bowl(place.x, place.y) + 0.9 * radius, "{place}");
            assert!(place.z < 0.8 && root.linear.length() < 0.1, "{place} {}", root.linear);
            lowest = lowest.min(place.z);
        }
        assert!(lowest < 0.1, "{lowest}");
    }
}

/// A box that slides against the first riser stops there. One that lies across a nose keeps its place, held
/// by the tread alone. A ball that falls on the nose leaves it on the side of its centre.
#[test]
fn a_stair_is_touched_from_its_treads_and_its_risers() {
    let mut world = world(1e-3);
    spawn(&mut world, Spawn { contact_settings: surface(0.2, 0.0), ..ground(&stairs()) });
    let half = 0.1;
    let model = cuboid(DVec3::splat(2.0 * half), 1.0);
    spawn(&mut world, robot("slides", &model, at(-0.4, 0.0, half), false));
    throw(&mut world, "slides", DVec3::X * 2.0, DVec3::ZERO);
    spawn(&mut world, robot("across", &model, at(0.08, 0.5, 0.08 + half), false));
    spawn(&mut world, robot("left", &ball(half, 1.0), at(-0.05, -0.5, 0.4), false));
    run(&mut world, 2.0);
    let seen = look(&world);
    let place = |i: usize| seen.roots[i].pose.translation;
    assert!((-half - 0.05..-half + 1e-3).contains(&place(1).x), "{}", place(1));
    assert!((place(1).z - half).abs() < 1e-3, "{}", place(1));
    assert!((place(2) - DVec3::new(0.08, 0.5, 0.08 + half)).length() < 1e-3, "{}", place(2));
    assert!(place(3).x < -half + 1e-3 && (place(3).z - half).abs() < 1e-3, "{}", place(3));
}

/// The edge of an upright sheet, from above.
#[test]
fn an_edge_of_an_obtuse_triangle_carries() {
    // An upright wall of two triangles. Upwards also leads out of the first one over the edge between the
    // two, away from the ball.
    let corners = [[0.0, 1.0], [1.0, 1.0], [4.0, 0.0], [4.0, 1.0]].map(|[x, z]| DVec3::new(x, 0.0, z));
    let wall = mesh(corners.to_vec(), vec![[0, 1, 2], [1, 3, 2]], None, DVec3::ONE);
    for body in [ball(0.2, 1.0), cuboid(DVec3::splat(0.4), 1.0)] {
        let mut world = world(1e-3);
        spawn(&mut world, ground(&wall));
        spawn(&mut world, robot("body", &body, at(0.5, 0.0, 1.25), false));
        run(&mut world, 0.3);
        let z = look(&world).roots[1].pose.translation.z;
        assert!((z - 1.2).abs() < 1e-3, "{z}");
    }
}

/// A wall of no thickness.
fn wall() -> Spawn {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let vertices = corners.iter().map(|&(y, z)| DVec3::new(0.0, y, z)).collect();
    ground(&mesh(vertices, vec![[0, 1, 2], [0, 2, 3]], None, DVec3::ONE))
}

/// It moves 1.9 m in a step, and contacts are searched 2 m ahead.
#[test]
fn a_ball_at_1_900_m_s_does_not_pass_a_thin_mesh() {
    for start in 0..8 {
        let mut world = world(1e-3);
        spawn(&mut world, wall());
        let at = DVec3::X * (5.0 + 0.25 * f64::from(start));
        spawn(&mut world, robot("ball", &ball(0.02, 0.1), DPose3::from_translation(at), false));
        throw(&mut world, "ball", DVec3::X * -1.9e3, DVec3::ZERO);
        for step in 0..20 {
            world.step();
            let x = look(&world).roots[1].pose.translation.x;
            assert!(x > 0.0, "from {at} in step {step}: {x}");
        }
    }
}

/// Hit at 5 m/s from either side, flat and on a corner.
#[test]
fn a_thin_mesh_lets_nothing_through() {
    let capsule = solid(&[(DPose3::IDENTITY, Geometry::Capsule { radius: 0.02, length: 0.1 })], 0.2);
    let cylinder = solid(&[(DPose3::IDENTITY, Geometry::Cylinder { radius: 0.03, length: 0.05 })], 0.2);
    let cone = solid(&[(DPose3::IDENTITY, Geometry::Cone { radius: 0.03, length: 0.06 })], 0.2);
    let bodies = [ball(0.02, 0.1), cuboid(DVec3::new(0.02, 0.1, 0.06), 0.3), capsule, cylinder, cone];
    let mut rng = Rng::with_seed(5);
    for h in [1e-3, 1.0 / 240.0] {
        for (body, turn) in bodies.iter().flat_map(|body| (0..4).map(move |turn| (body, turn))) {
            for side in [-1.0, 1.0] {
                let mut world = world(h);
                spawn(&mut world, wall());
                let any = |rng: &mut Rng| rng.f64() - 0.5;
                let rotation = if turn == 0 {
                    DQuat::IDENTITY
                } else {
                    DQuat::from_rotation_x(6.0 * any(&mut rng)) * DQuat::from_rotation_y(6.0 * any(&mut rng))
                };
                let place = DVec3::new(0.5 * side, 0.6 * any(&mut rng), 0.6 * any(&mut rng));
                spawn(&mut world, robot("body", body, DPose3::from_parts(place, rotation), false));
                throw(&mut world, "body", DVec3::X * (-5.0 * side), DVec3::ZERO);
                for _ in 0..(0.3 / h) as usize {
                    world.step();
                    let x = look(&world).roots[1].pose.translation.x;
                    assert!(x * side > 0.0, "{h} {turn} {side}: {x}");
                }
            }
        }
    }
}

/// A body that starts below the surface of a height field is in the ground, and comes up.
#[test]
fn bodies_that_start_in_a_height_field_come_out_of_it() {
    let mut world = world(1e-3);
    spawn(&mut world, ground(&field(11, 4.0, |x, _| 0.1 * x)));
    spawn(&mut world, robot("body", &ball(0.1, 1.0), at(0.3, 0.2, -0.4), false));
    run(&mut world, 3.0);
    let place = look(&world).roots[1].pose.translation;
    assert!(place.z > 0.1 * place.x + 0.095, "{place}");
}

/// Returns a world on rough ground, which bodies hit, roll over and rest on.
pub(crate) fn rough(rng: &mut Rng) -> Simulation {
    let mut world = world(2e-3);
    let bumps = |x: f64, y: f64| 0.1 * (3.0 * x).sin() * (2.0 * y).cos();
    let floor = grid(24, 3.0, || 0.0, bumps);
    spawn(&mut world, ground(&floor));
    let hill = Spawn { name: "hill".into(), pose: at(2.8, 0.0, -0.05), ..ground(&field(20, 3.0, bumps)) };
    spawn(&mut world, hill);
    let cylinder = solid(&[(DPose3::IDENTITY, Geometry::Cylinder { radius: 0.08, length: 0.1 })], 0.5);
    let capsule = solid(&[(DPose3::IDENTITY, Geometry::Capsule { radius: 0.05, length: 0.2 })], 0.5);
    let bodies = [ball(0.08, 0.5), cuboid(DVec3::new(0.2, 0.15, 0.1), 0.5), cylinder, capsule];
    for i in 0..12 {
        let pose = at(3.0 * rng.f64() - 0.5, 2.0 * rng.f64() - 1.0, 0.4 + 0.3 * rng.f64());
        spawn(&mut world, robot(&format!("body-{i}"), &bodies[i % 4], pose, false));
    }
    world
}

/// Houses of a metre in a square, three metres apart.
pub(crate) fn houses(count: usize) -> Vec<(DPose3, Geometry)> {
    let side = (count as f64).sqrt().ceil() as usize;
    let house = |i: usize| {
        let place = |at: usize| 3.0 * (at as f64 - side as f64 / 2.0) + 1.0;
        (at(place(i % side), place(i / side), 0.5), Geometry::Box { size: DVec3::ONE })
    };
    (0..count).map(house).collect()
}

/// Largest number of collider pairs that a step compares while a body slides between the houses of a town.
fn work_in_a_town(town: impl FnOnce(&mut Simulation)) -> u64 {
    let mut world = world(1e-3);
    spawn(&mut world, robot("plane", &plane(DVec3::Z), DPose3::IDENTITY, true));
    town(&mut world);
    spawn(&mut world, robot("body", &cuboid(DVec3::splat(0.3), 2.0), at(0.0, -0.5, 0.15), false));
    throw(&mut world, "body", DVec3::new(0.0, 2.0, 0.0), DVec3::ZERO);
    let step = |world: &mut Simulation| {
        world.step();
        world.compared_colliders()
    };
    let most = (0..500).map(|_| step(&mut world)).max().unwrap_or(0);
    assert!(look(&world).roots.last().unwrap().pose.translation.z > 0.14);
    most
}

/// The number of compared pairs does not grow with the bodies around: counted, for shapes of one link and for
/// robots.
#[test]
fn immovable_objects_cost_a_step_nothing() {
    let of_shapes = |count: usize| {
        work_in_a_town(|world| {
            spawn(world, robot("town", &solid(&houses(count), 1.0), DPose3::IDENTITY, true));
        })
    };
    let of_robots = |count: usize| {
        work_in_a_town(|world| {
            for (i, (pose, shape)) in houses(count).into_iter().enumerate() {
                spawn(
                    world,
                    robot(&format!("house-{i}"), &solid(&[(DPose3::IDENTITY, shape)], 1.0), pose, true),
                );
            }
        })
    };
    let [few, many] = [of_shapes(100), of_shapes(10_000)];
    assert!(few == many && many <= 4, "{few} {many}");
    let [few, many] = [of_robots(100), of_robots(1_000)];
    assert!(few == many && many <= 4, "{few} {many}");
}

/// A house that is moved is found at its new place, and no longer at the old one.
#[test]
fn immovable_objects_are_found_where_they_were_put() {
    let mut world = world(1e-3);
    spawn(&mut world, robot("plane", &plane(DVec3::Z), DPose3::IDENTITY, true));
    spawn(&mut world, robot("town", &solid(&houses(400), 1.0), DPose3::IDENTITY, true));
    for (i, (pose, shape)) in houses(40).into_iter().enumerate() {
        let pose = DPose3::from_translation(pose.translation + DVec3::Z * 20.0);
        spawn(
            &mut world,
            robot(&format!("house-{i}"), &solid(&[(DPose3::IDENTITY, shape)], 1.0), pose, true),
        );
    }
    // Onto a roof of the town, one metre up.
    spawn(&mut world, robot("body", &ball(0.1, 1.0), at(1.0, 1.0, 1.3), false));
    run(&mut world, 1.0);
    let height = |world: &Simulation| look(world).roots.last().unwrap().pose.translation.z;
    assert!((height(&world) - 1.1).abs() < 1e-3, "{}", height(&world));
    // The town is pulled from under it, and then a house pushed under it.
    let put = |world: &mut Simulation, robot: &str, pose: DPose3| {
        apply(world, Command::SetEntityState { robot: robot.into(), pose: Some(pose), twist: None });
    };
    put(&mut world, "town", at(1.5, 0.0, 0.0));
    run(&mut world, 1.0);
    assert!((height(&world) - 0.1).abs() < 1e-3, "{}", height(&world));
    let under = look(&world).roots.last().unwrap().pose.translation;
    put(&mut world, "house-7", at(under.x, under.y, -0.3));
    run(&mut world, 2.0);
    assert!((height(&world) - 0.3).abs() < 1e-3, "{}", height(&world));
}
