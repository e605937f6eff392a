//! Inertial units: f = R' (a - g), in the sensor's axes, and the angular velocity there.

use std::sync::Arc;

use glamx::{DPose3, DQuat, DVec3};
use simd_core::simulation::command::{
    JointReset, JointTarget, RobotReset, RobotTargets, SetTargets, Spawn, Target,
};
use simd_core::simulation::measure::{ImuMeasurement, Measurement};
use simd_core::{Command, Simulation};
use simd_model::RobotModel;
use simd_model::sensor::SensorKind;
use simd_tests::scenes::{apply, ball, cuboid, plane, robot, spawn, throw};

use super::{add, create, measured};
use crate::chains::chain;
use simd_tests::world::{look, passive, world};

const G: f64 = 9.81;

fn imu(world: &mut Simulation) -> ImuMeasurement {
    match &measured(world)[..] {
        [Measurement::Imu(imu)] => *imu,
        other => panic!("{other:?}"),
    }
}

fn near(measured: DVec3, expected: DVec3, tolerance: f64) {
    assert!((measured - expected).length() < tolerance, "{measured}, not {expected}");
}

/// Returns a rod of a metre that turns about z, level.
fn turntable() -> Arc<RobotModel> {
    let mut model = chain(1);
    model.joints[0].axis = DVec3::Z;
    Arc::new(model)
}

fn turn(world: &mut Simulation, velocity: f64) {
    let joints =
        vec![JointReset { joint: "joint-1".into(), position: 0.0, velocity, ..JointReset::default() }];
    let reset = RobotReset { robot: "robot".into(), joints };
    apply(world, Command::ResetJoints { robots: vec![reset] });
}

/// Upwards 9.81 in any axes of the sensor, exact except for rounding. Tested on a fixed body, and on a
/// resting box, whose contacts hold it to 1e-9 of gravity.
#[test]
fn at_rest_it_feels_what_holds_it_up() {
    let turned = DQuat::from_rotation_x(0.4) * DQuat::from_rotation_z(1.1);
    let pose = DPose3::from_parts(DVec3::new(0.02, 0.01, 0.03), turned);
    for (is_fixed, tolerance) in [(true, 1e-12), (false, 1e-6)] {
        let mut world = world(1e-3);
        spawn(&mut world, robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true));
        let at = DPose3::from_translation(DVec3::Z * 0.1);
        spawn(&mut world, robot("box", &cuboid(DVec3::splat(0.2), 1.0), at, is_fixed));
        (0..600).for_each(|_| world.step());
        add(&mut world, create("box", "body", pose, SensorKind::Imu));
        let imu = imu(&mut world);
        near(imu.linear_acceleration, turned.inverse() * (DVec3::Z * G), tolerance);
        near(imu.angular_velocity, DVec3::ZERO, tolerance);
        assert!(imu.orientation.dot(turned).abs() > 1.0 - 1e-9, "{}", imu.orientation);
    }
}

/// Zero at the centre of a falling body; beside it the centripetal acceleration, w x (w x r). A ball turns
/// evenly, so that a step has no error.
#[test]
fn in_free_fall_it_feels_only_its_own_turning() {
    let mut world = world(1e-3);
    spawn(&mut world, robot("ball", &ball(0.1, 2.0), DPose3::IDENTITY, false));
    throw(&mut world, "ball", DVec3::new(1.0, -2.0, 3.0), DVec3::ZERO);
    add(&mut world, create("ball", "body", DPose3::IDENTITY, SensorKind::Imu));
    (0..100).for_each(|_| near(imu(&mut world).linear_acceleration, DVec3::ZERO, 1e-9));
    apply(&mut world, Command::DeleteSensor { robot: "ball".into(), name: "imu_1".into() });

    let (spin, reach) = (DVec3::new(0.0, 0.0, 5.0), DVec3::new(0.03, 0.04, 0.02));
    throw(&mut world, "ball", DVec3::ZERO, spin);
    add(&mut world, create("ball", "body", DPose3::from_translation(reach), SensorKind::Imu));
    for _ in 0..100 {
        let imu = imu(&mut world);
        near(imu.linear_acceleration, spin.cross(spin.cross(reach)), 1e-9);
        near(imu.angular_velocity, spin, 1e-9);
    }
}

/// On a turntable r from the axis at w: w^2 r towards the axis and 9.81 upwards.
#[test]
fn on_a_turntable_it_feels_the_way_to_the_axis() {
    let (velocity, reach) = (3.0, 0.7);
    let mut world = world(1e-3);
    apply(&mut world, Command::Spawn(Box::new(passive(&turntable(), false, &[0.0]))));
    turn(&mut world, velocity);
    let pose = DPose3::from_translation(DVec3::X * reach);
    add(&mut world, create("robot", "link-1", pose, SensorKind::Imu));
    for _ in 0..2_000 {
        let imu = imu(&mut world);
        near(imu.linear_acceleration, DVec3::new(-velocity * velocity * reach, 0.0, G), 1e-9);
        near(imu.angular_velocity, DVec3::Z * velocity, 1e-9);
    }
}

/// A torque T on a rod of m l^2 / 3 = 1/3 kg m^2 accelerates it by 3 T. The sensor measures that times r
/// along its path, and w^2 r towards the axis, with the published velocity.
#[test]
fn on_a_turntable_that_speeds_up_it_feels_that_too() {
    let (torque, reach) = (0.2, 0.5);
    let mut world = world(1e-3);
    let start = Spawn { passive: false, ..passive(&turntable(), false, &[0.0]) };
    apply(&mut world, Command::Spawn(Box::new(start)));
    let target = JointTarget { joint: "joint-1".into(), axis: 0, target: Target::Effort(torque) };
    let robots =
        vec![RobotTargets { robot: "robot".into(), joints: vec![target], ..RobotTargets::default() }];
    apply(&mut world, Command::SetTargets(SetTargets { robots, ..SetTargets::default() }));
    let pose = DPose3::from_translation(DVec3::X * reach);
    add(&mut world, create("robot", "link-1", pose, SensorKind::Imu));
    for step in 0..1_000 {
        let imu = imu(&mut world);
        let velocity = look(&world).velocities[0];
        if step > 0 {
            let expected = DVec3::new(-velocity * velocity * reach, 3.0 * torque * reach, G);
            near(imu.linear_acceleration, expected, 1e-9);
        }
    }
}

/// A rod that falls from level, q its angle: `w^2 = 3 g sin q` by its energy and `dw/dt = 3/2 g cos q`. At r
/// along the rod the sensor measures `-g sin q (1 + 3 r)` along the rod and `g cos q (1 - 3 r / 2)` across
/// it. Across, the step's acceleration is measured: it belongs to the state before, which is at most `3/2 g w
/// r h` off. Along, the result is exact to rounding.
#[test]
fn on_a_pendulum_it_feels_the_radial_and_the_tangential_part() {
    let reach = 0.9;
    for time_step in [1e-3, 1e-4] {
        let mut world = world(time_step);
        apply(&mut world, Command::Spawn(Box::new(passive(&Arc::new(chain(1)), false, &[0.0]))));
        let pose = DPose3::from_translation(DVec3::X * reach);
        add(&mut world, create("robot", "link-1", pose, SensorKind::Imu));
        for _ in 0..(1.0 / time_step) as usize {
            let imu = imu(&mut world);
            let state = look(&world);
            let (angle, velocity) = (state.positions[0], state.velocities[0]);
            let along = -velocity * velocity * reach - G * angle.sin();
            assert!((imu.linear_acceleration.x - along).abs() < 1e-9, "{}", imu.linear_acceleration);
            assert!(imu.linear_acceleration.y.abs() < 1e-9);
            let closed = DVec3::new(
                -G * angle.sin() * (1.0 + 3.0 * reach),
                0.0,
                G * angle.cos() * (1.0 - 1.5 * reach),
            );
            near(imu.linear_acceleration, closed, 100.0 * time_step);
            near(imu.angular_velocity, DVec3::Y * velocity, 1e-12);
        }
    }
}
