//! Sensors of force and torque: at a wrist that holds a load, at rest and accelerated.

use std::sync::Arc;

use glamx::{DMat3, DPose3, DQuat, DVec3};
use simd_core::simulation::command::{JointTarget, RobotTargets, SetTargets, Spawn, Target};
use simd_core::simulation::measure::{Measurement, WrenchMeasurement};
use simd_core::{Command, Simulation};
use simd_model::RobotModel;
use simd_model::robot::{Inertial, JointKind};
use simd_model::sensor::{SensorKind, WrenchAxes, WrenchDirection};
use simd_tests::scenes::apply;

use super::{add, create, measured};
use crate::chains::chain;
use simd_tests::world::{passive, world};

const G: f64 = 9.81;

fn wrench(world: &mut Simulation) -> WrenchMeasurement {
    match &measured(world)[..] {
        [Measurement::ForceTorque(wrench)] => *wrench,
        other => panic!("{other:?}"),
    }
}

fn near(measured: DVec3, expected: DVec3) {
    assert!((measured - expected).length() < 1e-9, "{measured}, not {expected}");
}

/// Returns a hand of 2 kg on a slide along x, and a load of 1 kg welded to it. Its frame is turned and
/// shifted.
fn gripper(hand_from_load: DPose3, center: DVec3) -> Arc<RobotModel> {
    let mut model = chain(2);
    model.joints[0].kind = JointKind::Prismatic;
    model.joints[0].axis = DVec3::X;
    model.joints[1].kind = JointKind::Fixed;
    model.joints[1].parent_from_joint = hand_from_load;
    let inertia = DMat3::from_diagonal(DVec3::splat(1e-3));
    model.links[1].inertial = Inertial { mass: 2.0, center_of_mass: DVec3::ZERO, inertia };
    model.links[2].inertial = Inertial { mass: 1.0, center_of_mass: center, inertia };
    Arc::new(model)
}

fn kind(axes: WrenchAxes, direction: WrenchDirection) -> SensorKind {
    SensorKind::ForceTorque { axes, direction }
}

/// Across a weld, under a hanging mass: the child pulls its parent down by m g, with the torque of its centre
/// about the sensor. The load is turned, the robot stands askew and the sensor is beside the joint; exact
/// except for rounding.
#[test]
fn under_a_hanging_mass_it_shows_its_weight_and_lever() {
    let turn = DQuat::from_rotation_y(0.7) * DQuat::from_rotation_x(-0.3);
    let load = DPose3::from_parts(DVec3::new(0.1, 0.2, -0.3), turn);
    let (root, center) = (DQuat::from_rotation_x(0.5), DVec3::new(0.01, 0.02, 0.3));
    let sensor = DPose3::from_parts(DVec3::new(0.05, 0.0, -0.02), DQuat::from_rotation_z(0.9));
    let force = DVec3::Z * -G;
    let child_from_world = (root * turn).inverse();
    let lever = center - sensor.translation;
    for (axes, to_axes) in [
        (WrenchAxes::Child, DQuat::IDENTITY),
        (WrenchAxes::Parent, turn),
        (WrenchAxes::Sensor, sensor.rotation.inverse()),
    ] {
        for (direction, sign) in
            [(WrenchDirection::ChildOnParent, 1.0), (WrenchDirection::ParentOnChild, -1.0)]
        {
            let mut world = world(1e-3);
            let mut model = RobotModel::clone(&gripper(load, center));
            model.joints[0].kind = JointKind::Fixed;
            let start = Spawn { pose: DPose3::from_rotation(root), ..passive(&Arc::new(model), false, &[]) };
            apply(&mut world, Command::Spawn(Box::new(start)));
            add(&mut world, create("robot", "joint-2", sensor, kind(axes, direction)));
            let in_child = child_from_world * force;
            let wrench = wrench(&mut world);
            near(wrench.force, to_axes * in_child * sign);
            near(wrench.torque, to_axes * lever.cross(in_child) * sign);
        }
    }
}

/// 6 N on 3 kg are 2 m/s^2. The hand pushes the load of 1 kg by 2 N along the slide, and holds its weight.
#[test]
fn under_an_accelerated_mass_it_shows_what_accelerates_it() {
    let center = DVec3::new(0.0, 0.0, 0.25);
    let mut world = world(1e-3);
    let start = Spawn { passive: false, ..passive(&gripper(DPose3::IDENTITY, center), false, &[0.0]) };
    apply(&mut world, Command::Spawn(Box::new(start)));
    let target = JointTarget { joint: "joint-1".into(), axis: 0, target: Target::Effort(6.0) };
    let robots =
        vec![RobotTargets { robot: "robot".into(), joints: vec![target], ..RobotTargets::default() }];
    apply(&mut world, Command::SetTargets(SetTargets { robots, ..SetTargets::default() }));
    world.step();
    let kind = kind(WrenchAxes::Child, WrenchDirection::ParentOnChild);
    add(&mut world, create("robot", "joint-2", DPose3::IDENTITY, kind));
    for _ in 0..100 {
        let wrench = wrench(&mut world);
        let force = DVec3::new(2.0, 0.0, G);
        near(wrench.force, force);
        near(wrench.torque, center.cross(force));
    }
}

/// Two sensors on one joint measure opposite wrenches.
#[test]
fn child_and_parent_feel_the_same_with_opposite_signs() {
    let mut world = world(1e-3);
    apply(&mut world, Command::Spawn(Box::new(passive(&Arc::new(chain(3)), false, &[0.3, -0.5, 0.8]))));
    for direction in [WrenchDirection::ChildOnParent, WrenchDirection::ParentOnChild] {
        add(&mut world, create("robot", "joint-2", DPose3::IDENTITY, kind(WrenchAxes::Child, direction)));
    }
    let mut largest: f64 = 0.0;
    for _ in 0..200 {
        let both = measured(&mut world);
        let [Measurement::ForceTorque(one), Measurement::ForceTorque(other)] = both[..] else {
            panic!("{both:?}");
        };
        assert_eq!((one.force, one.torque), (-other.force, -other.torque));
        largest = largest.max(one.force.length());
    }
    assert!(largest > 1.0, "{largest}");
}
