//! Copies in lanes that touch something step alone while they do.

use super::lanes::{alone, assert_equal, assert_in_lanes, in_all_widths};
use super::*;

/// A copy that lies on the plane steps alone.
#[test]
fn copies_that_fall_and_land_have_the_bits_of_the_world() {
    let mut world = Simulation::new(PhysicsSettings::default(), WorldLimits::default());
    world.apply(&spawn("arm", arm([1.0, 0.5]), false, DVec3::Z * 0.6)).unwrap();
    let ground = one_link("ground", Geometry::Plane { normal: DVec3::Z });
    world.apply(&spawn("ground", ground, true, DVec3::ZERO)).unwrap();
    (0..3).for_each(|_| world.step());
    let values = (0..6).flat_map(|copy| [0.2 * copy as f64, -0.5]).collect();
    let request = RolloutRequest {
        controls: vec![control(ControlMode::Position, values, 1, 1)],
        quantities: vec![
            Quantity::RootPose("arm".into()),
            Quantity::RootTwist("arm".into()),
            Quantity::ContactCount("arm".into()),
        ],
        ..all_of_it(6, 600)
    };
    let rollout = Rollout::new(world.to_saved(), request, ROOM).unwrap();
    assert!(rollout.has_lanes);
    let expected = alone(&rollout, 0..6);
    let width = rollout.shape().columns();
    let touches = expected.states.chunks_exact(width).filter(|row| row[width - 1] > 0.0).count();
    assert!(touches > 10, "{touches}");
    for (width, found) in in_all_widths(&rollout, 0..6) {
        assert_equal(&found, &expected, &format!("{width} lanes"));
        assert_in_lanes(&found, 0.1, &format!("{width} lanes"));
    }
}

/// The arm above a floor that it reaches and leaves again.
#[test]
fn copies_that_come_to_touch_something_and_leave_it_have_the_bits_of_the_world() {
    let floor = one_link("floor", Geometry::Box { size: DVec3::new(4.0, 4.0, 0.2) });
    let plane = one_link("plane", Geometry::Plane { normal: DVec3::Z });
    for (ground, height) in [(floor, -0.1), (plane, 0.0)] {
        touch_and_leave(ground, height);
    }
}

fn touch_and_leave(ground: RobotModel, height: f64) {
    let mut world = Simulation::new(PhysicsSettings::default(), WorldLimits::default());
    world.apply(&spawn("arm", arm([1.0, 0.5]), true, DVec3::ZERO)).unwrap();
    world.apply(&spawn("ground", ground, true, DVec3::Z * height)).unwrap();
    (0..5).for_each(|_| world.step());
    let clearance = world.lane_clearance(0, false);
    assert!(clearance.around > 0.3, "it is far from the floor: {clearance:?}");
    let down = [1.4, 0.4, -0.5, 0.3];
    let values = (0..6).flat_map(|copy| down.map(|target| target * (1.0 - 0.3 * copy as f64))).collect();
    let request = RolloutRequest {
        controls: vec![control(ControlMode::Position, values, 2, 300)],
        quantities: vec![
            Quantity::JointPositions(named("arm")),
            Quantity::JointVelocities(named("arm")),
            Quantity::JointEfforts(named("arm")),
            Quantity::ContactForce(named("arm")),
            Quantity::ContactCount("arm".into()),
        ],
        record_every: 3,
        ..all_of_it(6, 900)
    };
    let rollout = Rollout::new(world.to_saved(), request, ROOM).unwrap();
    assert!(rollout.has_lanes);
    let expected = alone(&rollout, 0..6);
    let touches = |copy: usize| {
        let rows = expected.states.chunks_exact(8).skip(copy * 300).take(300);
        rows.filter(|row| row[6] > 0.0).count()
    };
    assert!(touches(0) > 10 && touches(0) < 290 && touches(5) == 0, "{} {}", touches(0), touches(5));
    for (width, found) in in_all_widths(&rollout, 0..6) {
        assert_equal(&found, &expected, &format!("{width} lanes"));
        assert_in_lanes(&found, 0.1, &format!("{width} lanes"));
    }
}
