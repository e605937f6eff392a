//! Position, velocity and effort, with default gains and under gravity.

use simd_client::{Target, proto};
use simd_tests::daemon::{Daemon, Via};

use crate::{arm, load_arm, set, shoulder};

async fn arm_at(time_step: f64) -> Daemon {
    let daemon = arm(Via::Grpc).await;
    let request = proto::SetPhysicsRequest { time_step: Some(time_step), ..Default::default() };
    daemon.client.set_physics(request).await.unwrap();
    daemon
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_position_target_settles_within_a_milliradian() {
    for time_step in [1e-3, 1e-4] {
        let daemon = arm_at(time_step).await;
        set(&daemon, Target::position(0.5)).await;
        daemon.pass(0.5).await;
        assert!((shoulder(&daemon).await.position - 0.5).abs() < 1e-3);
        // And stays.
        daemon.pass(0.5).await;
        let seen = shoulder(&daemon).await;
        assert!((seen.position - 0.5).abs() < 1e-3 && seen.velocity.abs() < 1e-6, "{seen:?}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_velocity_target_holds_within_a_percent_all_the_way_round() {
    for time_step in [1e-3, 1e-4] {
        let daemon = arm_at(time_step).await;
        set(&daemon, Target::velocity(1.0)).await;
        daemon.pass(0.2).await;
        for _ in 0..32 {
            daemon.pass(0.2).await;
            let velocity = shoulder(&daemon).await.velocity;
            assert!((velocity - 1.0).abs() < 0.01, "{velocity}");
        }
    }
}

/// The period of small swings is 1.0288 s, about the angle at which the arm hangs
/// straight down: 0.039919 + pi / 2.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn effort_zero_swings_freely() {
    for time_step in [1e-3, 1e-4] {
        let daemon = arm_at(time_step).await;
        let down = 0.039919 + std::f64::consts::FRAC_PI_2;
        let reset = proto::JointReset {
            joint: "shoulder".into(),
            position: down + 0.05,
            ..proto::JointReset::default()
        };
        daemon.client.reset_joints("arm", vec![reset]).await.unwrap();
        set(&daemon, Target::Effort(0.0)).await;
        daemon.pass(1.0288).await;
        let seen = shoulder(&daemon).await;
        assert!((seen.position - down - 0.05).abs() < 1e-3, "{seen:?}");
        daemon.pass(1.0288 / 2.0).await;
        assert!((shoulder(&daemon).await.position - down + 0.05).abs() < 1e-3);
    }
}

/// q(1 s) = 0.704120 by the pendulum equation; the error is of first order in the time step.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_passive_arm_swings_as_the_pendulum_equation_says() {
    for time_step in [1e-3, 1e-4] {
        let daemon = arm_at(time_step).await;
        let joint = proto::JointReset { joint: "shoulder".into(), position: 0.3, ..Default::default() };
        daemon.client.reset_joints("arm", vec![joint]).await.unwrap();
        set(&daemon, Target::Passive).await;
        daemon.pass(1.0).await;
        let q = shoulder(&daemon).await.position;
        assert!((q - 0.704120).abs() < 4.0 * time_step, "{q}");
    }
}

/// Between two answers one millisecond apart, the position moves no further than the peak velocity of the
/// stiffest mode allows, for any targets.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn switching_modes_while_moving_is_smooth() {
    let daemon = arm(Via::Grpc).await;
    let mut before = shoulder(&daemon).await;
    for target in [
        Target::velocity(1.0),
        Target::position(0.6),
        Target::Effort(0.0),
        Target::Hold,
        Target::velocity(-1.0),
        Target::Passive,
        Target::position(0.0),
    ] {
        set(&daemon, target).await;
        for _ in 0..50 {
            daemon.client.step(1).await.unwrap();
            let now = shoulder(&daemon).await;
            let moved = (now.position - before.position).abs();
            // 300 rad/s over e for each radian of distance, for a millisecond, plus the previous velocity.
            assert!(moved < 0.12 + before.velocity.abs() * 2e-3, "{target:?}: {moved}");
            before = now;
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn targets_for_several_robots_take_effect_at_one_step_or_not_at_all() {
    let daemon = arm(Via::Grpc).await;
    load_arm(&daemon.client, "other").await;
    let targets = |robot: &str, position: f64| proto::RobotTargets {
        robot: robot.into(),
        whole: Some(proto::WholeRobotTarget {
            mode: proto::JointMode::Position.into(),
            values: vec![position],
        }),
        ..Default::default()
    };
    let both = proto::SetJointTargetsRequest {
        robots: vec![targets("arm", 0.2), targets("other", -0.2)],
        ..Default::default()
    };
    daemon.client.set_targets(both).await.unwrap();
    let half_wrong = proto::SetJointTargetsRequest {
        robots: vec![targets("arm", 0.9), targets("other", f64::NAN)],
        ..Default::default()
    };
    daemon.client.set_targets(half_wrong).await.unwrap_err();
    daemon.pass(1.0).await;
    let states = daemon.client.joint_states(Vec::new()).await.unwrap();
    let positions: Vec<f64> = states.robots.iter().map(|robot| robot.position[0]).collect();
    assert!((positions[0] - 0.2).abs() < 1e-3 && (positions[1] + 0.2).abs() < 1e-3, "{positions:?}");
}
