//! `simd_client::testing`: waiting in simulated time.

use simd_client::Target;
use simd_client::testing::{NotYet, positions, until};
use simd_tests::daemon::Via;

use crate::{arm, set};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_condition_is_waited_for_in_a_paused_and_in_a_playing_world() {
    let daemon = arm(Via::Grpc).await;
    let client = &daemon.client;
    set(&daemon, Target::position(0.3)).await;
    let there = async || positions(client, "arm", &[("shoulder", 0.3)], 0.01).await;
    let reading = until(client, 5.0, there).await.unwrap();
    assert!((reading.joints[0].position[0] - 0.3).abs() <= 0.01);
    client.play().await.unwrap();
    set(&daemon, Target::position(0.1)).await;
    until(client, 5.0, async || positions(client, "arm", &[("shoulder", 0.1)], 0.01).await).await.unwrap();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_condition_that_never_holds_ends_in_simulated_time_and_says_how_far_off_it_is() {
    let daemon = arm(Via::Grpc).await;
    let client = &daemon.client;
    let off = until(client, 0.05, async || positions(client, "arm", &[("shoulder", 2.0)], 0.01).await).await;
    let said = off.unwrap_err().to_string();
    let part = "wanted 2.0000 within 0.01 rad (waited for it for 0.0500 simulated seconds)";
    assert!(said.starts_with("joint shoulder of arm is at ") && said.ends_with(part), "{said}");
    assert_eq!(client.world_statistics().await.unwrap().stamp.unwrap().step, 50);
    let unknown =
        until(client, 5.0, async || positions(client, "absent", &[("shoulder", 2.0)], 0.01).await).await;
    assert!(matches!(unknown, Err(NotYet::Failed(_))), "waiting does not help");
}
