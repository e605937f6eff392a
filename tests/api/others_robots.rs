//! Other people's robots hold poses and reach new ones with default gains.

use fastrand::Rng;
use simd_client::proto::{JointLayout, JointReset, JointType, RobotTargets, SetJointTargetsRequest};
use simd_client::{Target, every_joint, joint_target};
use simd_tests::daemon::{Daemon, fixed};
use simd_tests::pybullet_data;

/// A joint that can be driven: its name, its index in the arrays, its stiffness, its range.
struct Driven {
    name: String,
    index: usize,
    stiffness: f64,
    range: (f64, f64),
}

fn driven(layout: &JointLayout) -> Vec<Driven> {
    let single = [JointType::Revolute, JointType::Continuous, JointType::Prismatic];
    let joints =
        layout.joints.iter().filter(|joint| single.contains(&joint.r#type()) && joint.mimic.is_none());
    joints
        .map(|joint| {
            let limits = joint.limits.unwrap_or_default();
            Driven {
                name: joint.name.clone(),
                index: joint.velocity_index as usize,
                stiffness: joint.default_gains.unwrap().stiffness,
                range: (limits.lower.unwrap_or(f64::NEG_INFINITY), limits.upper.unwrap_or(f64::INFINITY)),
            }
        })
        .collect()
}

/// Three seeded poses inside the limits, each held for five simulated seconds within 1e-3 rad or the static
/// error of the spring. Then a step of 0.2 on every joint, as far as its limits allow.
async fn holds_and_steps(robot: &str) {
    let daemon = Daemon::paused().await;
    daemon.client.load(pybullet_data::folder().join(robot), fixed("robot")).await.unwrap();
    let joints = driven(&daemon.client.joint_layout("robot").await.unwrap());
    assert!(!joints.is_empty());
    let rng = &mut Rng::with_seed(2026);
    for _ in 0..3 {
        let pose: Vec<f64> = joints
            .iter()
            .map(|joint| {
                let (lower, upper) = (joint.range.0.max(-1.5), joint.range.1.min(1.5));
                // A range that does not reach into -1.5 to 1.5 has its nearest end.
                if lower < upper { lower + (upper - lower) * rng.f64() } else { joint.range.0 }
            })
            .collect();
        let resets = joints.iter().zip(&pose).map(|(joint, &position)| JointReset {
            joint: joint.name.clone(),
            position,
            ..JointReset::default()
        });
        daemon.client.reset_joints("robot", resets.collect()).await.unwrap();
        go(&daemon, &joints, &pose).await;
        for _ in 0..5 {
            daemon.pass(1.0).await;
            arrived(&daemon, robot, &joints, &pose).await;
        }
        let stepped: Vec<f64> = joints
            .iter()
            .zip(&pose)
            .map(|(joint, q)| if q + 0.2 <= joint.range.1 { q + 0.2 } else { (q - 0.2).max(joint.range.0) })
            .collect();
        go(&daemon, &joints, &stepped).await;
        daemon.pass(3.0).await;
        arrived(&daemon, robot, &joints, &stepped).await;
    }
}

async fn go(daemon: &Daemon, joints: &[Driven], pose: &[f64]) {
    let targets = joints.iter().zip(pose);
    let targets = targets.map(|(joint, &q)| joint_target(joint.name.clone(), Target::position(q)));
    let robots =
        vec![RobotTargets { robot: "robot".into(), joints: targets.collect(), ..RobotTargets::default() }];
    let answer =
        daemon.client.set_targets(SetJointTargetsRequest { robots, ..Default::default() }).await.unwrap();
    assert!(answer.clamped.is_empty(), "{answer:?}");
}

async fn arrived(daemon: &Daemon, robot: &str, joints: &[Driven], pose: &[f64]) {
    let states = daemon.client.joint_states(vec![every_joint("robot")]).await.unwrap();
    let states = &states.robots[0];
    for (joint, target) in joints.iter().zip(pose) {
        let (position, effort) = (states.position[joint.index], states.effort[joint.index]);
        let bound = 1e-3f64.max(1.01 * (effort / joint.stiffness).abs());
        let error = (position - target).abs();
        assert!(error <= bound, "{robot}: {} is {error:.2e} off, effort {effort}", joint.name);
    }
}

macro_rules! robots {
    ($($name:ident: $urdf:literal;)*) => {$(
        #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
        async fn $name() {
            holds_and_steps($urdf).await;
        }
    )*};
}

robots! {
    kuka_iiwa_holds_and_steps: "kuka_iiwa/model.urdf";
    franka_panda_holds_and_steps: "franka_panda/panda.urdf";
    pendulum5_holds_and_steps: "pendulum5.urdf";
    a1_holds_and_steps: "a1/a1.urdf";
    laikago_holds_and_steps: "laikago/laikago_toes.urdf";
    mini_cheetah_holds_and_steps: "mini_cheetah/mini_cheetah.urdf";
    r2d2_holds_and_steps: "r2d2.urdf";
    cartpole_holds_and_steps: "cartpole.urdf";
    racecar_holds_and_steps: "racecar/racecar.urdf";
    two_joint_robot_holds_and_steps: "TwoJointRobot_w_fixedJoints.urdf";
    xarm6_with_its_mimic_gripper_holds_and_steps: "xarm/xarm6_with_gripper.urdf";
}
