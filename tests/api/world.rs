//! Time, pace, resets, saved states.

use std::time::Duration;

use simd_client::proto::{self, ErrorReason, SimulationState};
use simd_client::{Target, every_joint};
use simd_tests::daemon::{Daemon, Via};
use simd_world::handle::Pace;

use crate::{arm, set, shoulder};

async fn a_paused_world_moves_by_the_steps_that_are_asked_for(via: Via) {
    let daemon = arm(via).await;
    let stamp = daemon.client.step(250).await.unwrap();
    assert_eq!((stamp.step, stamp.sim_time), (250, 0.25));
    let statistics = daemon.client.world_statistics().await.unwrap();
    assert_eq!(statistics.iterations, 250);
    assert_eq!(statistics.state(), SimulationState::Paused);
}

async fn stepping_a_playing_world_is_refused_with_the_remedy(via: Via) {
    let daemon = arm(via).await;
    daemon.client.play().await.unwrap();
    let error = daemon.client.step(1).await.unwrap_err();
    assert_eq!(error.reason(), Some(ErrorReason::WrongState));
    assert!(error.to_string().contains("pause"), "{error}");
}

/// As fast as possible: the world does a second of time while this test waits for its states.
async fn a_playing_world_continues_without_calls(via: Via) {
    let daemon =
        Daemon::start_via(via, |config| config.driver.pace = Pace::AsFastAsPossible { factor: 1.0 }).await;
    let mut sequence = 0;
    loop {
        let states = daemon.client.next_states(sequence, Duration::from_secs(1), Vec::new()).await.unwrap();
        let stamp = states.stamp.unwrap();
        assert!(stamp.sequence > sequence);
        sequence = stamp.sequence;
        if stamp.sim_time > 1.0 {
            break;
        }
    }
}

async fn resets_begin_an_epoch_and_put_back_what_their_scope_says(via: Via) {
    let daemon = arm(via).await;
    set(&daemon, Target::position(0.5)).await;
    daemon.pass(0.5).await;
    let time = proto::ResetSimulationRequest { time: true, ..Default::default() };
    let stamp = daemon.client.reset(time).await.unwrap().stamp.unwrap();
    assert_eq!((stamp.epoch, stamp.step), (1, 0));
    assert!(shoulder(&daemon).await.position > 0.4);
    let state = proto::ResetSimulationRequest { state: true, ..Default::default() };
    daemon.client.reset(state).await.unwrap();
    assert_eq!(shoulder(&daemon).await.position, 0.0);
    let spawned = proto::ResetSimulationRequest { spawned: true, ..Default::default() };
    assert_eq!(daemon.client.reset(spawned).await.unwrap().deleted, ["arm"]);
    assert!(daemon.client.robots().await.unwrap().is_empty());
}

async fn a_restored_state_runs_on_to_the_same_bits(via: Via) {
    let daemon = arm(via).await;
    set(&daemon, Target::velocity(2.0)).await;
    daemon.pass(0.1).await;
    daemon.client.save_state("mark").await.unwrap();
    daemon.pass(0.3).await;
    let first = shoulder(&daemon).await;
    daemon.client.restore_state("mark").await.unwrap();
    daemon.pass(0.3).await;
    let second = shoulder(&daemon).await;
    assert_eq!(first.position.to_bits(), second.position.to_bits());
    assert_eq!(first.effort.to_bits(), second.effort.to_bits());
}

/// A retry that carries the id of a call that was done gets its answer, and steps no further.
async fn a_retried_reset_is_done_once(via: Via) {
    let daemon = arm(via).await;
    let request =
        proto::ResetSimulationRequest { time: true, request_id: "the-first".into(), ..Default::default() };
    let first = daemon.client.reset(request.clone()).await.unwrap().stamp.unwrap();
    daemon.pass(0.1).await;
    let again = daemon.client.reset(request).await.unwrap().stamp.unwrap();
    assert_eq!((again.epoch, again.step), (first.epoch, first.step));
    let states = daemon.client.joint_states(vec![every_joint("arm")]).await.unwrap();
    assert_eq!(states.stamp.unwrap().step, 100);
}

crate::over_every_transport![
    a_paused_world_moves_by_the_steps_that_are_asked_for,
    stepping_a_playing_world_is_refused_with_the_remedy,
    a_playing_world_continues_without_calls,
    resets_begin_an_epoch_and_put_back_what_their_scope_says,
    a_restored_state_runs_on_to_the_same_bits,
    a_retried_reset_is_done_once,
];
