//! Guarantees of the daemon for its clients: the same over every transport.
//!
//! A test takes the transport, and [`over_every_transport`] runs it for each. Tests of only the physics run
//! once, over gRPC: `control`, `others_robots`.
#![cfg(test)]

mod audit;
mod ball_joints;
mod blocked_joints;
mod cameras;
mod changing_sensors;
mod claims;
mod clients;
mod collision_filters;
mod compounds;
mod connections;
mod constraints;
mod control;
mod frames;
mod history;
mod hostile;
mod http;
mod json;
mod kinematics;
mod limited_tokens;
mod limits;
mod lockstep;
mod lockstep_group;
mod looks;
mod markers;
mod method_walk;
mod metrics;
mod others_robots;
mod owners;
mod parameters;
mod queries;
mod recordings;
mod refusals;
mod retries;
mod robots;
mod rollouts;
mod saved_state_files;
mod security;
mod sensor_publications;
mod sensors;
mod shares;
mod streams;
mod tendons;
mod terrain;
mod testing;
mod tls;
mod tokens;
mod trajectories;
mod viewing;
mod world;
mod zenoh;
mod zenoh_acl;
mod zenoh_untrusted;

use simd_client::proto::JointMode;
use simd_client::{Client, Target, every_joint, joint_target};
use simd_tests::daemon::{Daemon, Via, fixed};
use simd_tests::robots::assets;

/// Tests of these functions, one over each transport.
macro_rules! over_every_transport {
    ($($test:ident,)+) => {
        $(mod $test {
            use simd_tests::daemon::Via;

            #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
            async fn over_the_handle() {
                super::$test(Via::Handle).await;
            }

            #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
            async fn over_grpc() {
                super::$test(Via::Grpc).await;
            }

            #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
            async fn over_grpc_web() {
                super::$test(Via::Web).await;
            }

            #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
            async fn in_json() {
                super::$test(Via::Json).await;
            }

            #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
            async fn over_zenoh() {
                super::$test(Via::Zenoh).await;
            }
        })+
    };
}

pub(crate) use over_every_transport;

/// Returns a paused world with the SolidWorks-style arm, fixed, as "arm".
pub(crate) async fn arm(via: Via) -> Daemon {
    let daemon = Daemon::paused_via(via).await;
    load_arm(&daemon.client, "arm").await;
    daemon
}

pub(crate) async fn load_arm(client: &Client, name: &str) {
    client.load(assets().join("Bench_Arm-1.2 rev B"), fixed(name)).await.unwrap();
}

pub(crate) async fn set(daemon: &Daemon, target: Target) {
    daemon.client.set_robot_targets("arm", [joint_target("shoulder", target)]).await.unwrap();
}

/// State of the arm's joint.
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
