//! One client cannot use up all parameters, saved states and claims: its own count as long as they exist.

use std::fmt::Debug;
use std::time::Duration;

use simd_client::access::Role;
use simd_client::proto::{ErrorReason, NameTakenPolicy};
use simd_client::{Client, Error, every_joint};
use simd_server::config::Config;
use simd_tests::daemon::{Daemon, Via};
use simd_world::handle::RunState;

use crate::load_arm;
use crate::security::{guarded, of, of_second, options};

const MINUTE: Duration = Duration::from_secs(60);

/// Two parameters with eight bytes of names, a saved state and a claim.
fn small_shares(config: &mut Config) {
    config.driver.state = RunState::Paused;
    let limits = &mut config.limits;
    (limits.parameters_of_client, limits.parameter_bytes_of_client) = (2, 8);
    (limits.saved_states_of_client, limits.claims_of_client) = (1, 1);
}

async fn add(client: &Client, name: &str) -> Result<(), Error> {
    client.add_slider(name, (0.0, 1.0), 0.5, NameTakenPolicy::Replace).await.map(drop)
}

async fn claim(client: &Client, robot: &str) -> Result<String, Error> {
    client.claim_joints(vec![every_joint(robot)], "me", MINUTE).await
}

fn refused<T: Debug>(outcome: Result<T, Error>, what: &str) {
    let error = outcome.unwrap_err();
    assert_eq!(error.reason(), Some(ErrorReason::LimitExceeded), "{error}");
    assert!(error.to_string().starts_with(what), "{error}");
}

/// Replaced and removed ones no longer count.
async fn one_has_its_share_and_another_has_room(one: &Client, other: &Client) {
    for name in ["a", "b", "a"] {
        add(one, name).await.unwrap();
    }
    refused(add(one, "c").await, "the number of parameters of ");
    one.remove_parameters(vec!["a".into()]).await.unwrap();
    refused(add(one, "too_long").await, "the bytes of the names of parameters of ");
    add(one, "c").await.unwrap();
    add(other, "d").await.unwrap();

    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("state");
    for _ in 0..2 {
        one.save_state("mine").await.unwrap();
    }
    one.export_saved_state("mine", &file).await.unwrap();
    for saved in [
        one.save_state("more").await,
        // The daemon would make up a name.
        one.save_state("").await,
        one.import_saved_state(&file, "more").await,
    ] {
        refused(saved, "the number of saved states of ");
    }
    other.save_state("yours").await.unwrap();
    one.delete_saved_state("mine").await.unwrap();
    one.import_saved_state(&file, "more").await.unwrap();

    let secret = claim(one, "arm").await.unwrap();
    refused(claim(one, "second").await, "the number of claims of ");
    let other_secret = claim(other, "second").await.unwrap();
    other.release_joints(&other_secret).await.unwrap();
    one.release_joints(&secret).await.unwrap();
    claim(one, "second").await.unwrap();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_client_is_held_to_its_share_over_each_transport() {
    for via in [Via::Grpc, Via::Zenoh] {
        let daemon = Daemon::start_via(via, small_shares).await;
        for robot in ["arm", "second"] {
            load_arm(&daemon.client, robot).await;
        }
        let one = daemon.client.clone().with_name("one");
        let other = daemon.another_client().await.with_name("other");
        one_has_its_share_and_another_has_room(&one, &other).await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_token_has_one_share_over_all_transports_together() {
    let guarded = guarded(|config, _| small_shares(config)).await;
    let (grpc, zenoh) = (guarded.grpc(), guarded.running.locators()[0].clone());
    let connect = async |place: &str, token: String| {
        Client::connect_with(place, options(Some(token), None)).await.unwrap()
    };
    let one = connect(&grpc, of(Role::Admin)).await;
    let same = connect(&zenoh, of(Role::Admin)).await;
    let other = connect(&zenoh, of_second()).await;
    for robot in ["arm", "second"] {
        load_arm(&one, robot).await;
    }
    one_has_its_share_and_another_has_room(&one, &other).await;
    refused(add(&same, "e").await, "the number of parameters of the token of admin would be 3");
    refused(same.save_state("third").await, "the number of saved states of the token of admin would be 2");
    refused(claim(&same, "arm").await, "the number of claims of the token of admin would be 2");
}

/// Nor has a world that is embedded in a program.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_process_itself_has_no_share() {
    let daemon = Daemon::start_via(Via::Handle, small_shares).await;
    for name in ["a", "b", "c", "a longer name"] {
        add(&daemon.client, name).await.unwrap();
        daemon.client.save_state(name).await.unwrap();
    }
}
