//! Friction against rolling and spinning, compared with closed forms.
//!
//! On a rolling ball of mass m, radius R and moment I = 2/5 m R^2, the torque r m g brakes. With F the
//! friction at the point of contact, `m a = F` and `I a / R = r m g - F R`, so that `a = 5/7 r g / R`.

use simd_tests::world::run;
use std::sync::Arc;

use glamx::{DPose3, DQuat, DVec3};
use simd_core::simulation::command::{ContactSettings, LinkProperties, PhysicsChange, Spawn};
use simd_core::{Command, Integrator, Simulation};
use simd_model::RobotModel;
use simd_model::robot::Material;
use simd_tests::contact_scene::keep_awake;
use simd_tests::scenes::*;

const G: f64 = 9.81;
const R: f64 = 0.1;

/// Depth of resting bodies in their support, as a part of R.
const DEPTH: f64 = 1e-3;

fn turning(rolling: f64, spinning: f64) -> ContactSettings {
    let material = Material {
        friction: Some(0.8),
        rolling_friction: Some(rolling),
        spinning_friction: Some(spinning),
        ..Material::default()
    };
    ContactSettings {
        links: vec![LinkProperties { material, ..LinkProperties::default() }],
        ..ContactSettings::default()
    }
}

/// Returns a body on a plane that leans by `angle` about y, this high above it.
fn on_a_plane(
    model: &Arc<RobotModel>,
    (height, angle): (f64, f64),
    (own, ground): (ContactSettings, ContactSettings),
    (h, integrator): (f64, Integrator),
) -> Simulation {
    let mut world = world(h);
    let integrator = Some(integrator);
    apply(&mut world, Command::SetPhysics(PhysicsChange { integrator, ..Default::default() }));
    let tilt = DQuat::from_rotation_y(angle);
    let plane = robot("ground", &plane(DVec3::Z), DPose3::from_rotation(tilt), true);
    spawn(&mut world, Spawn { contact_settings: ground, ..plane });
    let pose = DPose3::from_parts(tilt * DVec3::Z * height, tilt);
    spawn(&mut world, Spawn { contact_settings: own, ..robot("body", model, pose, false) });
    keep_awake(&mut world, "body");
    world
}

const BOTH: [Integrator; 2] = [Integrator::Leapfrog, Integrator::Euler];

/// The coefficient may be either one's: the larger holds.
#[test]
fn a_ball_rolls_out_as_its_rolling_friction_says() {
    let r = 2e-3;
    for integrator in BOTH {
        for surfaces in [(turning(r, 0.0), turning(0.0, 0.0)), (turning(0.5 * r, 0.0), turning(r, 0.0))] {
            let mut world = on_a_plane(&ball(R, 3.0), (R, 0.0), surfaces, (1e-3, integrator));
            run(&mut world, 0.1);
            throw(&mut world, "body", DVec3::X, DVec3::Y / R);
            run(&mut world, 2.0);
            let root = look(&world).roots[1].clone();
            let expected = 1.0 - 5.0 / 7.0 * r * G / R * 2.0;
            assert!(
                (root.linear.x / expected - 1.0).abs() < DEPTH,
                "{integrator:?}: {} {expected}",
                root.linear
            );
            assert!((root.angular.y * R / expected - 1.0).abs() < DEPTH, "{integrator:?}: {}", root.angular);
            // It stops when that is used up, and stays.
            run(&mut world, 6.0);
            let stopped = look(&world).roots[1].clone();
            run(&mut world, 1.0);
            let after = look(&world).roots[1].clone();
            assert!(stopped.linear.length() < 1e-6 && stopped.angular.length() < 1e-5, "{}", stopped.linear);
            assert!(after.pose.translation.distance(stopped.pose.translation) < 1e-6);
            let way = 0.5 / (5.0 / 7.0 * r * G / R);
            assert!(
                (stopped.pose.translation.x / way - 1.0).abs() < 2.0 * DEPTH,
                "{}",
                stopped.pose.translation
            );
        }
    }
}

/// w = w0 - s m g / I t, and then rest; a ball, and a disc that stands on its rim.
#[test]
fn a_ball_spins_out_as_its_spinning_friction_says() {
    let s = 1e-3;
    let moment_by_mass = 0.4 * R * R;
    for integrator in BOTH {
        let surfaces = (turning(0.0, s), turning(0.0, 0.0));
        let mut world = on_a_plane(&ball(R, 3.0), (R, 0.0), surfaces, (1e-3, integrator));
        run(&mut world, 0.1);
        throw(&mut world, "body", DVec3::ZERO, DVec3::Z * 10.0);
        run(&mut world, 2.0);
        let expected = 10.0 - s * G / moment_by_mass * 2.0;
        let velocity = look(&world).roots[1].angular;
        assert!((velocity.z / expected - 1.0).abs() < DEPTH, "{integrator:?}: {velocity} {expected}");
        run(&mut world, 3.0);
        assert!(look(&world).roots[1].angular.length() < 1e-6, "{}", look(&world).roots[1].angular);
    }
}

/// tan a = r / R is the steepest slope on which a ball rests; on a steeper one it rolls with `5/7 (g sin a -
/// r g cos a / R)`.
#[test]
fn a_ball_rests_on_a_slope_that_its_rolling_friction_holds() {
    let r = 0.1 * R;
    for integrator in BOTH {
        for angle in [0.09, 0.15] {
            let surfaces = (turning(r, 0.0), turning(0.0, 0.0));
            let mut world = on_a_plane(&ball(R, 0.5), (R, angle), surfaces, (1e-3, integrator));
            run(&mut world, 0.5);
            let before = look(&world).roots[1].clone();
            run(&mut world, 1.0);
            let after = look(&world).roots[1].clone();
            let downhill = DQuat::from_rotation_y(angle) * DVec3::X;
            if angle.tan() < r / R {
                let creep = after.pose.translation.distance(before.pose.translation);
                assert!(creep < 1e-6, "{integrator:?}: {creep} m in a second");
            } else {
                let gained = (after.linear - before.linear).dot(downhill);
                let expected = 5.0 / 7.0 * G * (angle.sin() - r / R * angle.cos());
                assert!((gained / expected - 1.0).abs() < DEPTH, "{integrator:?}: {gained} {expected}");
            }
        }
    }
}

/// A box on four corners. The sum of their torques is s m g, in addition to the torque of the corners'
/// friction at their arms.
#[test]
fn a_box_that_slips_turns_out_by_its_spinning_friction() {
    let (s, side) = (5e-3, 0.2);
    for integrator in BOTH {
        let mut slippery = turning(0.0, s);
        slippery.links[0].material.friction = Some(0.0);
        let surfaces = (slippery, turning(0.0, 0.0));
        let model = cuboid(DVec3::splat(side), 2.0);
        let mut world = on_a_plane(&model, (side / 2.0, 0.0), surfaces, (1e-3, integrator));
        run(&mut world, 0.1);
        throw(&mut world, "body", DVec3::ZERO, DVec3::Z * 8.0);
        run(&mut world, 0.5);
        let expected = 8.0 - s * G / (side * side / 6.0) * 0.5;
        let velocity = look(&world).roots[1].angular;
        assert!((velocity.z / expected - 1.0).abs() < DEPTH, "{integrator:?}: {velocity} {expected}");
    }
}

/// Coefficients of zero have no effect, to the bit: a ball that is thrown, bounces and rolls.
#[test]
fn coefficients_of_zero_change_no_bit() {
    for integrator in BOTH {
        let plain = |friction| {
            let mut plain = turning(0.0, 0.0);
            let material = Material { friction: Some(friction), ..Material::default() };
            plain.links[0].material = material;
            plain
        };
        let zero = (turning(0.0, 0.0), turning(0.0, 0.0));
        let nothing = (plain(0.8), plain(0.8));
        let run = |surfaces| {
            let mut world = on_a_plane(&ball(R, 0.7), (0.3, 0.1), surfaces, (1e-3, integrator));
            throw(&mut world, "body", DVec3::new(0.3, 0.7, 0.0), DVec3::new(1.0, -2.0, 3.0));
            (0..2_000).for_each(|_| world.step());
            let root = look(&world).roots[1].clone();
            (root.pose, root.linear, root.angular)
        };
        assert_eq!(run(zero), run(nothing));
    }
}

/// A state with torques that hold runs on to the bit after a restore.
#[test]
fn bodies_held_by_turning_friction_continue_to_the_bit() {
    let r = 0.1 * R;
    let surfaces = (turning(r, r), turning(0.0, 0.0));
    let mut world = on_a_plane(&ball(R, 0.5), (R, 0.05), surfaces, (1e-3, Integrator::Leapfrog));
    throw(&mut world, "body", DVec3::Y * 0.2, DVec3::Z);
    run(&mut world, 0.3);
    apply(&mut world, Command::SaveState { name: "here".into() });
    run(&mut world, 0.3);
    let expected = world.fingerprint();
    apply(&mut world, Command::RestoreState { name: "here".into() });
    run(&mut world, 0.3);
    assert_eq!(world.fingerprint(), expected);
}
