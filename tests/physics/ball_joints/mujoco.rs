//! Ball joints compared with MuJoCo's Euler integrator: `tests/reference/make_ball_joints.py` made the
//! figures.

use serde::Deserialize;
use simd_core::Command;
use simd_core::simulation::command::*;
use simd_tests::robots;

use super::*;
use simd_tests::world::{apply, euler, passive, run};

#[derive(Deserialize)]
struct Reference {
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    name: String,
    urdf: String,
    free: bool,
    damping: f64,
    armature: f64,
    time_step: f64,
    seconds: f64,
    start: Vec<Start>,
    links: Vec<LinkPose>,
    velocities: Vec<Velocity>,
}

#[derive(Deserialize)]
struct Start {
    joint: String,
    #[serde(default)]
    orientation: Option<[f64; 4]>,
    #[serde(default)]
    position: f64,
    velocity: Vec<f64>,
}

#[derive(Deserialize)]
struct LinkPose {
    link: String,
    /// x y z, quaternion x y z w.
    pose: [f64; 7],
}

#[derive(Deserialize)]
struct Velocity {
    joint: String,
    velocity: Vec<f64>,
}

/// Both codes do the same arithmetic in another order, as with joints of one axis: links agree with MuJoCo's
/// within 1e-6 m and rad.
#[test]
fn swings_and_flights_equal_mujocos_euler() {
    let reference: Reference =
        serde_json::from_str(include_str!("../../reference/ball_joints.json")).unwrap();
    let mut failures = Vec::new();
    for case in &reference.cases {
        let error = largest_error(case);
        println!("{:45} {error:.1e}", case.name);
        if error.is_nan() || error > 1e-6 {
            failures.push(format!("{}: {error:e}", case.name));
        }
    }
    assert!(reference.cases.len() >= 18 && failures.is_empty(), "{failures:#?}");
}

fn largest_error(case: &Case) -> f64 {
    let (model, _) = robots::read(&format!("../reference/robots/{}", case.urdf));
    let mut world = euler(case.time_step);
    apply(&mut world, Command::Spawn(Box::new(passive(&model, case.free, &[]))));
    let properties = case.start.iter().map(|start| JointProperties {
        joint: start.joint.clone(),
        damping: Some(case.damping),
        friction: Some(0.0),
        armature: Some(case.armature),
        limits: Some(JointLimits::default()),
        ..JointProperties::default()
    });
    let joints = properties.collect();
    apply(&mut world, Command::SetJointProperties { robot: "robot".into(), joints });
    let joints = case.start.iter().map(|start| JointReset {
        joint: start.joint.clone(),
        position: start.position,
        velocity: start.velocity[0],
        spherical: start.orientation.map(|orientation| SphericalReset {
            orientation: DQuat::from_array(orientation),
            angular_velocity: DVec3::from_slice(&start.velocity),
        }),
        axis: 0,
    });
    let robots = vec![RobotReset { robot: "robot".into(), joints: joints.collect() }];
    apply(&mut world, Command::ResetJoints { robots });
    if case.free {
        let twist = Some((DVec3::new(0.1, -0.2, 0.3), DVec3::new(0.5, -0.4, 0.6)));
        apply(&mut world, Command::SetEntityState { robot: "robot".into(), pose: None, twist });
    }
    let seen = run(&mut world, case.seconds);
    let poses = seen.link_poses(0).unwrap();
    let mut worst = 0.0f64;
    for LinkPose { link, pose: [x, y, z, a, b, c, d] } in &case.links {
        let index = model.links.iter().position(|known| known.name == *link).unwrap();
        let apart = rotation_vector(poses[index].rotation.inverse() * DQuat::from_xyzw(*a, *b, *c, *d));
        worst = worst.max(poses[index].translation.distance(DVec3::new(*x, *y, *z)));
        worst = worst.max(apart.length());
    }
    let entity = &seen.world.entities[0];
    for Velocity { joint, velocity } in &case.velocities {
        let index = model.joints.iter().position(|known| known.name == *joint).unwrap();
        let own = &seen.velocities[entity.joint_velocities[index].clone()];
        assert_eq!(own.len(), velocity.len(), "{joint}");
        for (own, theirs) in own.iter().zip(velocity) {
            // Velocities are some tens of times larger than their changes over a radian.
            worst = worst.max((own - theirs).abs() / 10.0);
        }
    }
    worst
}
