//! What a client of the daemon can rely on, over gRPC.
#![cfg(test)]

mod control;
mod kinematics;
mod lockstep;
mod others_robots;
mod parameters;
mod refusals;
mod robots;
mod streams;
mod world;

use simd_client::proto::JointMode;
use simd_client::{Client, Target, every_joint, joint_target};
use simd_tests::daemon::{Daemon, fixed};
use simd_tests::robots::assets;

/// A paused world with the SolidWorks-style arm, fixed, as "arm".
pub(crate) async fn arm() -> Daemon {
    let daemon = Daemon::paused().await;
    load_arm(&daemon.client, "arm").await;
    daemon
}

pub(crate) async fn load_arm(client: &Client, name: &str) {
    client.load(assets().join("Bench_Arm-1.2 rev B"), fixed(name)).await.unwrap();
}

pub(crate) async fn set(daemon: &Daemon, target: Target) {
    daemon.client.set_robot_targets("arm", [joint_target("shoulder", target)]).await.unwrap();
}

/// What the arm's joint does.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Shoulder {
    pub(crate) position: f64,
    pub(crate) velocity: f64,
    pub(crate) effort: f64,
    pub(crate) target: f64,
    pub(crate) mode: JointMode,
}

pub(crate) async fn shoulder(daemon: &Daemon) -> Shoulder {
    let states = daemon.client.joint_states(vec![every_joint("arm")]).await.unwrap();
    let robot = &states.robots[0];
    Shoulder {
        position: robot.position[0],
        velocity: robot.velocity[0],
        effort: robot.effort[0],
        target: robot.target[0],
        mode: robot.mode().next().unwrap(),
    }
}
