//! Slow motion: unbalanced bodies move and bodies without friction continue, however slowly; sleep stops
//! neither.

use glamx::{DPose3, DQuat, DVec3};
use simd_core::simulation::command::{PhysicsChange, Spawn};
use simd_core::{Command, Simulation};
use simd_tests::scenes::*;
use simd_tests::world::{at, run};

use crate::sleeping::is_asleep;

fn set_physics(world: &mut Simulation, change: PhysicsChange) {
    apply(world, Command::SetPhysics(change));
}

/// A slope of this angle without friction, and a box on it. The box has slid g sin(angle) t^2 / 2 after t
/// seconds, at any slope.
#[test]
fn unbalanced_bodies_slide_however_slowly() {
    for (gravity, angle, seconds) in [(1e-3, 0.3, 20.0), (6e-5, 0.5, 20.0), (9.81, 2e-5, 20.0)] {
        let mut world = world(1e-3);
        set_physics(
            &mut world,
            PhysicsChange { gravity: Some(DVec3::Z * -gravity), ..PhysicsChange::default() },
        );
        let tilt = DQuat::from_rotation_y(angle);
        let smooth = surface(0.0, 0.0);
        let slope = robot("slope", &plane(DVec3::Z), DPose3::from_rotation(tilt), true);
        spawn(&mut world, Spawn { contact_settings: smooth.clone(), ..slope });
        let start = tilt * (DVec3::Z * 0.05);
        let pose = DPose3::from_parts(start, tilt);
        let body = robot("box", &cuboid(DVec3::splat(0.1), 1.0), pose, false);
        spawn(&mut world, Spawn { contact_settings: smooth, ..body });
        run(&mut world, seconds);
        let way = (look(&world).roots[1].pose.translation - start).dot(tilt * DVec3::X);
        let formula = 0.5 * gravity * angle.sin() * seconds * seconds;
        assert!(
            (way / formula - 1.0).abs() < 1e-3,
            "g {gravity}, {angle} rad: {way}, by the formula {formula}"
        );
    }
}

#[test]
fn bodies_without_friction_continue_to_slide_slowly() {
    let mut world = world(1e-3);
    let smooth = surface(0.0, 0.0);
    let ground = robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true);
    spawn(&mut world, Spawn { contact_settings: smooth.clone(), ..ground });
    let body = robot("box", &cuboid(DVec3::splat(0.1), 1.0), at(0.0, 0.0, 0.05), false);
    spawn(&mut world, Spawn { contact_settings: smooth, ..body });
    throw(&mut world, "box", DVec3::X * 4e-4, DVec3::ZERO);
    run(&mut world, 10.0);
    let way = look(&world).roots[1].pose.translation.x;
    assert!((way / 4e-3 - 1.0).abs() < 1e-3, "{way}");
}

/// An unstable balance grows by e each `sqrt(2 a / 3 g)` of a second, a the half of the side: it has fallen
/// within 3 s.
#[test]
fn a_box_just_beyond_its_edge_falls() {
    let mut world = world(1e-3);
    spawn(&mut world, robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true));
    let lean = std::f64::consts::FRAC_PI_4 + 1e-7;
    let height = 0.05 * std::f64::consts::SQRT_2 - 1e-5;
    let pose = DPose3::from_parts(DVec3::Z * height, DQuat::from_rotation_y(lean));
    spawn(&mut world, robot("box", &cuboid(DVec3::splat(0.1), 1.0), pose, false));
    let end = run(&mut world, 3.0);
    assert!(end.roots[1].pose.translation.z < 0.06, "{:?}", end.roots[1].pose);
}

#[test]
fn a_world_that_does_not_sleep_keeps_its_bodies_awake() {
    let mut world = world(1e-3);
    spawn(&mut world, robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true));
    spawn(&mut world, robot("box", &cuboid(DVec3::splat(0.1), 1.0), at(0.0, 0.0, 0.05), false));
    run(&mut world, 2.0);
    assert!(is_asleep(&mut world, "box"));
    set_physics(&mut world, PhysicsChange { sleeping: Some(false), ..PhysicsChange::default() });
    run(&mut world, 2.0);
    assert!(!is_asleep(&mut world, "box"));
}
