//! Forces at rest, compared with closed forms: of all forces with the same motion, those with the least sum
//! of squares.
//!
//! If points of one body press with normal forces n_i at places x_i, and nothing else distinguishes them, the
//! least forces are n_i = a + b . x_i: a plane, with a and b from the sums of forces and moments. Friction is
//! zero if nothing pulls sideways.

use simd_tests::world::at;
use simd_tests::world::run;
use std::sync::Arc;

use glamx::{DPose3, DQuat, DVec3};
use simd_core::simulation::command::*;
use simd_core::{Command, Integrator, Simulation};
use simd_model::robot::JointLimits;
use simd_tests::contact_scene::keep_awake;
use simd_tests::robots;
use simd_tests::scenes::*;

use crate::constraints::held;

const G: f64 = 9.81;

/// Tolerance of forces, N. Resting bodies are solved to rounding.
const TOLERANCE: f64 = 1e-6;

fn ground(time_step: f64) -> Simulation {
    let mut world = world(time_step);
    spawn(&mut world, robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true));
    world
}

/// Returns the sum of the contact forces between two robots, and the largest friction of a point.
fn between(world: &Simulation, names: [&str; 2]) -> Vec<Touching> {
    let all = contacts(world, Some(names[0]));
    all.into_iter().filter(|it| it.robots.iter().any(|name| name == names[1])).collect()
}

/// A box on a slack rope, whose other end is driven to values that are not finite. The box is solved without
/// it, and the ground carries it in the same step.
#[test]
fn the_ground_carries_a_box_on_whatever_becomes_of_what_it_is_tied_to() {
    let mut world = ground(1e-3);
    spawn(&mut world, robot("box", &cuboid(DVec3::splat(0.2), 1.0), at(0.0, 0.0, 0.1), false));
    spawn(&mut world, robot("arm", &pendulum(0.1, 1e-4), at(2.0, 0.0, 1.0), true));
    let end = |robot: &str, link: &str| RequestedEnd {
        robot: robot.into(),
        link: link.into(),
        ..RequestedEnd::default()
    };
    let rope = RequestedConstraint::Distance { length: Some(10.0), is_rope: true };
    let rope = held(rope, end("arm", "rod"), end("box", "body"));
    apply(&mut world, Command::CreateConstraint(Box::new(rope)));
    let carried = |world: &Simulation| {
        let touching = between(world, ["ground", "box"]);
        assert!(!touching.is_empty());
        touching.iter().map(|it| it.normal_force).sum::<f64>()
    };
    run(&mut world, 0.5);
    assert!((carried(&world) - G).abs() < 1e-3, "{}", carried(&world));
    let limits = Some(JointLimits { lower: Some(1e300), ..Default::default() });
    let joints = vec![JointProperties { joint: "hinge".into(), limits, ..Default::default() }];
    apply(&mut world, Command::SetJointProperties { robot: "arm".into(), joints });
    world.step();
    let seen = look(&world);
    assert!(seen.roots[2].disabled.is_some() && seen.roots[1].disabled.is_none());
    assert!((carried(&world) - G).abs() < 1e-3, "{}", carried(&world));
    run(&mut world, 0.5);
    assert!((carried(&world) - G).abs() < 1e-3, "{}", carried(&world));
}

/// m g / 4 = 2.4525 N at each of four corners, and no friction, half a second after it was put down. It
/// starts on the ground, a micrometre above it, or dropped by 5 mm.
#[test]
fn a_kilogram_rests_on_its_corners_alike() {
    for (height, seconds) in [(0.0, 0.5), (1e-6, 0.5), (5e-3, 0.6)] {
        for time_step in [1e-3, 4e-3] {
            let mut world = ground(time_step);
            let pose = at(0.0, 0.0, 0.1 + height);
            spawn(&mut world, robot("box", &cuboid(DVec3::splat(0.2), 1.0), pose, false));
            run(&mut world, seconds);
            let corners = contacts(&world, None);
            assert_eq!(corners.len(), 4);
            for corner in corners {
                let (normal, friction) = (corner.normal_force, corner.friction_force.length());
                assert!((normal - G / 4.0).abs() < TOLERANCE, "from {height} m at {time_step} s: {normal} N");
                assert!(friction < TOLERANCE, "from {height} m at {time_step} s: friction {friction} N");
            }
        }
    }
}

/// A table of 10 kg with a load of 5 kg at one place of its top. The forces of the points of its feet form a
/// plane over their places. The four points of the load carry a quarter of it each.
#[test]
fn the_feet_of_a_table_share_a_load_as_a_plane() {
    let (x, y) = (0.21, -0.13);
    let mut world = ground(1e-3);
    spawn(&mut world, robot("table", &table(), DPose3::IDENTITY, false));
    spawn(&mut world, robot("load", &cuboid(DVec3::splat(0.1), 5.0), at(x, y, 0.8), false));
    run(&mut world, 0.5);
    for corner in between(&world, ["table", "load"]) {
        assert!((corner.normal_force - 5.0 * G / 4.0).abs() < TOLERANCE, "{} N", corner.normal_force);
    }
    let feet = between(&world, ["table", "ground"]);
    assert!(feet.len() >= 12, "{} points", feet.len());
    let n = feet.len() as f64;
    let middle = feet.iter().map(|foot| foot.point).sum::<DVec3>() / n;
    let sum = |of: fn(DVec3) -> f64| feet.iter().map(|foot| of(foot.point - middle)).sum::<f64>();
    let (xx, xy, yy) = (sum(|p| p.x * p.x), sum(|p| p.x * p.y), sum(|p| p.y * p.y));
    let load = DVec3::new(x, y, 0.0) * 5.0 * G - middle * 15.0 * G;
    let determinant = xx * yy - xy * xy;
    let slope = ((load.x * yy - load.y * xy) / determinant, (load.y * xx - load.x * xy) / determinant);
    for foot in &feet {
        let from = foot.point - middle;
        let expected = 15.0 * G / n + slope.0 * from.x + slope.1 * from.y;
        assert!((foot.normal_force - expected).abs() < TOLERANCE, "{} N, not {expected}", foot.normal_force);
        assert!(foot.friction_force.length() < TOLERANCE, "friction {}", foot.friction_force);
    }
}

/// Returns the force on each link that touches something, world, by its name.
fn by_link(world: &Simulation, name: &str) -> Vec<(String, DVec3)> {
    let mut sums: Vec<(String, DVec3)> = Vec::new();
    for touching in contacts(world, Some(name)) {
        let side = usize::from(touching.robots[1] == name);
        let on_second = touching.normal * touching.normal_force + touching.friction_force;
        let force = if side == 1 { on_second } else { -on_second };
        match sums.iter_mut().find(|sum| sum.0 == touching.links[side]) {
            Some(sum) => sum.1 += force,
            None => sums.push((touching.links[side].clone(), force)),
        }
    }
    sums
}

/// Tolerance, as a part of the weight. Left and right, whose poses and masses are mirror images, carry alike,
/// and all feet carry the weight. Joints that hold a pose still settle for some seconds.
const ALIKE: f64 = 1e-4;

fn left_and_right_are_alike(world: &Simulation, name: &str, weight: f64) {
    let feet = by_link(world, name);
    let total: DVec3 = feet.iter().map(|foot| foot.1).sum();
    println!("{name}: {feet:?}");
    assert!((total - DVec3::Z * weight).length() < ALIKE * weight, "{name}: {total} N, not {weight} upwards");
    for (link, force) in feet.iter().filter(|foot| foot.0.contains("left")) {
        let other = feet.iter().find(|foot| foot.0 == link.replace("left", "right")).unwrap().1;
        let mirrored = DVec3::new(other.x, -other.y, other.z);
        assert!((*force - mirrored).length() < ALIKE * weight, "{link}: {force}, and on the right {other}");
    }
}

fn weight(model: &simd_model::RobotModel) -> f64 {
    model.links.iter().map(|link| link.inertial.mass).sum::<f64>() * G
}

#[test]
fn a_quadruped_stands_alike_on_left_and_right() {
    let model = quadruped();
    let mut world = ground(1e-3);
    let bent = |name: &str| {
        if name.contains("upper") {
            0.7
        } else if name.contains("lower") {
            -1.4
        } else {
            0.0
        }
    };
    let positions = model.joints.iter().map(|joint| (joint.name.clone(), bent(&joint.name)));
    let height = 0.4 * 0.7f64.cos() + 0.02;
    let standing = Spawn {
        joint_positions: positions.collect(),
        passive: false,
        ..robot("quadruped", &model, at(0.0, 0.0, height), false)
    };
    spawn(&mut world, standing);
    run(&mut world, 8.0);
    assert_eq!(by_link(&world, "quadruped").len(), 4);
    left_and_right_are_alike(&world, "quadruped", weight(&model));
}

#[test]
fn a_humanoid_stands_alike_on_left_and_right() {
    let (model, _) = robots::read("humanoid/urdf/humanoid.urdf");
    let mut world = standing(1e-3, &model, HUMANOID);
    // On joints that are springs it sways to and fro by a millimetre, and hardly after this time.
    run(&mut world, 24.0);
    assert_eq!(by_link(&world, "robot").len(), 2);
    left_and_right_are_alike(&world, "robot", weight(&model));
}

/// Height of the humanoid's pelvis with its soles on the ground.
const HUMANOID: f64 = 1.01;

/// A stack of three on a slope, held by friction, keeps its place except for rounding. Tested for ten
/// seconds, at any time step, with both integrators.
#[test]
fn bodies_held_by_friction_do_not_creep() {
    for integrator in [Integrator::Leapfrog, Integrator::Euler] {
        for time_step in [1e-4, 1e-3, 4e-3] {
            let creep = creep_on_a_slope(integrator, time_step);
            assert!(creep < 1e-12, "{integrator:?} at {time_step} s: {creep} m in ten seconds");
        }
    }
}

fn creep_on_a_slope(integrator: Integrator, time_step: f64) -> f64 {
    let tilt = DQuat::from_rotation_y(0.4);
    let mut world = world(time_step);
    let integrator = Some(integrator);
    apply(&mut world, Command::SetPhysics(PhysicsChange { integrator, ..Default::default() }));
    spawn(&mut world, robot("slope", &plane(DVec3::Z), DPose3::from_rotation(tilt), true));
    let size = DVec3::new(0.5, 0.5, 0.2);
    for (i, mass) in [1.0, 5.0, 0.2].into_iter().enumerate() {
        let place = tilt * DVec3::new(0.0, 0.0, 0.1 + 0.2 * i as f64);
        let name = format!("box-{i}");
        spawn(&mut world, robot(&name, &cuboid(size, mass), DPose3::from_parts(place, tilt), false));
        keep_awake(&mut world, &name);
    }
    run(&mut world, 0.5);
    let places =
        |world: &Simulation| -> Vec<DPose3> { look(world).roots.iter().map(|root| root.pose).collect() };
    let start = places(&world);
    run(&mut world, 10.0);
    let moved = start.iter().zip(places(&world));
    moved.map(|(before, after)| before.translation.distance(after.translation)).fold(0.0, f64::max)
}

/// The forces are a function of the present poses, and not of the past. After a box was pressed, pulled and
/// released they are as before. It may be tilted by the tolerated overlap, 0.02 mm: that moves its middle by
/// 0.01 mm of the 100 mm to a corner.
#[test]
fn forces_at_rest_do_not_depend_on_the_past() {
    let mut world = ground(1e-3);
    spawn(&mut world, robot("box", &cuboid(DVec3::splat(0.2), 1.0), at(0.0, 0.0, 0.1), false));
    keep_awake(&mut world, "box");
    for push in [DVec3::new(2.0, 1.0, -30.0), DVec3::new(-3.0, 2.0, 5.0)] {
        let wrench = LinkWrench {
            robot: "box".into(),
            link: "body".into(),
            force: push,
            torque: DVec3::new(0.1, -0.05, 0.02),
            in_link_axes: false,
            point: DVec3::new(0.03, 0.02, 0.1),
            duration: WrenchDuration::For(0.1),
        };
        apply(&mut world, Command::ApplyWrench(wrench));
        run(&mut world, 0.5);
        for corner in contacts(&world, None) {
            let (normal, friction) = (corner.normal_force, corner.friction_force.length());
            assert!(
                (normal - G / 4.0).abs() < 1e-4 * G / 4.0 && friction < TOLERANCE,
                "{normal} N, {friction} N"
            );
        }
    }
}

/// A restored world continues to the bit even if it is solved directly.
#[test]
fn resting_bodies_continue_to_the_bit_after_a_restore() {
    let build = || {
        let mut world = ground(1e-3);
        let model: Arc<_> = cuboid(DVec3::splat(0.2), 1.0);
        for (i, shift) in [0.0, 0.03, -0.02, 0.05].into_iter().enumerate() {
            spawn(
                &mut world,
                robot(&format!("box-{i}"), &model, at(shift, 0.0, 0.1 + 0.2001 * i as f64), false),
            );
        }
        world
    };
    let mut world = build();
    run(&mut world, 0.05);
    apply(&mut world, Command::SaveState { name: "kept".into() });
    run(&mut world, 0.3);
    let expected = world.fingerprint();
    apply(&mut world, Command::RestoreState { name: "kept".into() });
    run(&mut world, 0.3);
    assert_eq!(world.fingerprint(), expected);
}
