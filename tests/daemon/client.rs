//! The README's flow through the Rust client, against the process.

use simd_client::proto::{JointMode, JointType, SimulationState};
use simd_client::{ControlOptions, RobotReading, Target, every_joint, joint_target};

use crate::{demo, paused};

#[tokio::test]
async fn a_program_lists_moves_and_watches_the_demo_robot() {
    let daemon = demo().await;
    let client = daemon.client().await;
    let robots = client.robots().await.unwrap();
    assert_eq!(robots.iter().map(|robot| robot.name.as_str()).collect::<Vec<_>>(), ["bench_arm"]);
    assert!(robots[0].loaded_at_start);

    let layout = client.joint_layout("bench_arm").await.unwrap();
    let [shoulder] = layout.joints.as_slice() else { panic!("{layout:?}") };
    assert_eq!((shoulder.name.as_str(), shoulder.r#type()), ("shoulder", JointType::Continuous));
    assert_eq!((shoulder.parent_link.as_str(), shoulder.child_link.as_str()), ("base_link", "arm"));

    let selection = every_joint("bench_arm");
    let set = async |target| {
        let clamped =
            client.set_robot_targets("bench_arm", [joint_target("shoulder", target)]).await.unwrap();
        assert_eq!(clamped, []);
    };
    set(Target::position(0.5)).await;
    let mut watch = client.watch(vec![selection.clone()], 100.0).await.unwrap();
    let mut last = 0;
    loop {
        let states = watch.next().await.unwrap().unwrap();
        let reading = RobotReading::new(&layout, &selection, &states).unwrap();
        assert!(reading.stamp.sequence > last, "states come in order");
        last = reading.stamp.sequence;
        let joint = &reading.joints[0];
        if (joint.position[0] - 0.5).abs() < 1e-3 && joint.velocity[0].abs() < 1e-3 {
            break;
        }
    }
    set(Target::velocity(1.0)).await;
    loop {
        let states = watch.next().await.unwrap().unwrap();
        let joint = RobotReading::new(&layout, &selection, &states).unwrap().joints.swap_remove(0);
        if joint.mode == [JointMode::Velocity] && (joint.velocity[0] - 1.0).abs() < 0.01 {
            break;
        }
    }
    let statistics = client.world_statistics().await.unwrap();
    assert_eq!((statistics.state(), statistics.robots), (SimulationState::Playing, 1));
}

#[tokio::test]
async fn a_program_steps_a_paused_demo_and_reads_exact_states() {
    let daemon = paused().await;
    let client = daemon.client().await;
    let mut control = client.control(ControlOptions::default()).await.unwrap();
    control.send("bench_arm", [joint_target("shoulder", Target::position(0.5))]).unwrap();
    // A paused world publishes a command as a separate state: it is not a step.
    let states = control.next().await.unwrap().accepted().unwrap();
    assert_eq!(states.stamp.unwrap().step, 0);
    control.send_all(Vec::new()).unwrap();
    assert_eq!(client.step(1000).await.unwrap().step, 1000);
    let after = control.next().await.unwrap().accepted().unwrap().stamp.unwrap();
    assert!(after.step >= 1, "the answer waited for a newer state");

    let states = client.joint_states(Vec::new()).await.unwrap();
    assert_eq!(states.stamp.unwrap().step, 1000);
    let joint = client.read_joints(&every_joint("bench_arm")).await.unwrap().joints.swap_remove(0);
    assert!((joint.position[0] - 0.5).abs() < 1e-3, "{joint:?}");
    assert_eq!(joint.mode, [JointMode::Position]);
    assert_eq!(joint.target, [0.5]);
}
