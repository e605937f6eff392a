//! Gravity compensation: actuators that hold the weight of their joints' loads.

use simd_model::robot::Mimic;

use super::*;
use crate::dynamics::inverse_dynamics::inverse_dynamics;

/// Returns a prismatic joint across, and on it two links of the tutorial's arm in series.
fn slide_and_two_links(change: impl FnOnce(&mut [Joint])) -> Arc<RobotModel> {
    let one = arm();
    let moving = &one.links[1];
    let names = ["carriage", "arm", "forearm"];
    let links = names.map(|name| Link { name: name.into(), ..moving.clone() });
    let at = |x: f64| DPose3::from_parts(DVec3::new(x, 0.02, 0.1), DQuat::from_rotation_x(0.4));
    let joint = |name: &str, index: usize, axis: DVec3, kind| Joint {
        name: name.into(),
        kind,
        parent: index,
        child: index + 1,
        parent_from_joint: at(0.3 * index as f64),
        axis,
        ..arm_joint()
    };
    let mut joints = vec![
        joint("slide", 0, DVec3::new(0.6, 0.0, 0.8), JointKind::Prismatic),
        joint("shoulder", 1, DVec3::Y, JointKind::Continuous),
        joint("elbow", 2, DVec3::Y, JointKind::Continuous),
    ];
    change(&mut joints);
    let links = std::iter::once(one.links[0].clone()).chain(links).collect();
    Arc::new(RobotModel { name: "arm".into(), links, joints, ..RobotModel::default() })
}

/// Returns a robot on its side, with springs that hold nothing.
fn weak(model: Arc<RobotModel>, compensated: &[&str]) -> Simulation {
    let pose = DPose3::from_rotation(DQuat::from_rotation_x(1.1) * DQuat::from_rotation_z(0.7));
    let names: Vec<String> = model.joints.iter().map(|joint| joint.name.clone()).collect();
    let mut world = world_with(1e-3, Spawn { pose, ..spawn("arm", model) });
    let joints = names.iter().map(|name| JointProperties {
        joint: name.clone(),
        default_gains: Some((3.0, 1.0)),
        gravity_compensation: Some(compensated.contains(&name.as_str())),
        ..JointProperties::default()
    });
    world.apply(&Command::SetJointProperties { robot: "arm".into(), joints: joints.collect() }).unwrap();
    world
}

fn go(world: &mut Simulation, targets: &[(&str, Target)]) {
    let joints = targets.iter().map(|(joint, target)| JointTarget {
        joint: (*joint).into(),
        axis: 0,
        target: *target,
    });
    let robot = RobotTargets { robot: "arm".into(), joints: joints.collect(), ..RobotTargets::default() };
    world.apply(&Command::SetTargets(SetTargets { robots: vec![robot], ..SetTargets::default() })).unwrap();
}

const TARGETS: [(&str, f64); 3] = [("slide", 0.2), ("shoulder", 0.5), ("elbow", -0.9)];

/// Returns the efforts that hold the robot at its pose.
fn at_rest(seen: &PublishedState) -> Vec<f64> {
    let configuration = seen.configuration(0).unwrap();
    inverse_dynamics(&seen.world.entities[0].tree, &configuration, DVec3::NEG_Z * 9.81, &[], &[])
}

#[test]
fn weak_springs_reach_their_targets_where_gravity_is_compensated() {
    let targets = TARGETS.map(|(joint, at)| (joint, position(at)));
    let mut world = weak(slide_and_two_links(|_| {}), &["slide", "shoulder", "elbow"]);
    go(&mut world, &targets);
    let seen = run(&mut world, 30.0);
    for (index, (joint, target)) in TARGETS.into_iter().enumerate() {
        assert!((seen.positions[index] - target).abs() < 1e-9, "{joint}: {}", seen.positions[index]);
    }
    for (effort, wanted) in seen.efforts.iter().zip(at_rest(&seen)) {
        assert!((effort - wanted).abs() < 1e-9, "{effort} for {wanted}");
    }
    // Without it they sag.
    let mut world = weak(slide_and_two_links(|_| {}), &["shoulder"]);
    go(&mut world, &targets);
    let seen = run(&mut world, 30.0);
    assert!((seen.positions[0] - 0.2).abs() > 0.1 && (seen.positions[2] + 0.9).abs() > 0.01);
}

#[test]
fn a_joint_carries_what_follows_it_by_its_multiplier() {
    let model = slide_and_two_links(|joints| {
        joints[2].mimic = Some(Mimic { joint: 1, multiplier: -1.5, offset: 0.1 });
    });
    let mut world = weak(model, &["slide", "shoulder"]);
    go(&mut world, &[("slide", position(0.0)), ("shoulder", position(0.5))]);
    let seen = run(&mut world, 30.0);
    assert!((seen.positions[1] - 0.5).abs() < 1e-6, "{}", seen.positions[1]);
    assert!((seen.positions[2] + 0.65).abs() < 1e-6, "{}", seen.positions[2]);
}

#[test]
fn efforts_and_passive_joints_are_what_they_are_and_a_limit_holds() {
    let mut world = weak(slide_and_two_links(|_| {}), &["slide", "shoulder", "elbow"]);
    go(&mut world, &[("shoulder", Target::Effort(0.25)), ("elbow", Target::Passive)]);
    world.step();
    let seen = look(&world);
    assert_eq!((seen.efforts[1], seen.efforts[2]), (0.25, 0.0));
    let limits = JointLimits { effort: Some(0.1), ..JointLimits::default() };
    let joints = vec![JointProperties {
        joint: "shoulder".into(),
        limits: Some(limits),
        ..JointProperties::default()
    }];
    world.apply(&Command::SetJointProperties { robot: "arm".into(), joints }).unwrap();
    go(&mut world, &[("shoulder", Target::Hold)]);
    for _ in 0..500 {
        world.step();
        assert!(look(&world).efforts[1].abs() <= 0.1);
    }
}

#[test]
fn it_is_saved_and_continues_to_the_bit() {
    let mut world = weak(slide_and_two_links(|_| {}), &["slide", "elbow"]);
    go(&mut world, &TARGETS.map(|(joint, at)| (joint, position(at))));
    run(&mut world, 0.3);
    world.apply(&Command::SaveState { name: "here".into() }).unwrap();
    let first = run(&mut world, 1.0).fingerprint();
    let off = |joint: &str| JointProperties {
        joint: joint.into(),
        gravity_compensation: Some(false),
        ..JointProperties::default()
    };
    let joints = vec![off("slide"), off("elbow")];
    world.apply(&Command::SetJointProperties { robot: "arm".into(), joints }).unwrap();
    run(&mut world, 0.1);
    world.apply(&Command::RestoreState { name: "here".into() }).unwrap();
    let settings = &look(&world).settings[0];
    assert_eq!([0, 1, 2].map(|joint| settings.joints[joint].gravity_compensation), [true, false, true]);
    assert_eq!(run(&mut world, 1.0).fingerprint(), first);
}
