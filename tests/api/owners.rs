//! Saved states and parameters belong to their makers: while a claim or a token holds, no other client
//! replaces or removes them.

use std::time::Duration;

use simd_client::access::Role;
use simd_client::proto::{ClaimJointsRequest, ErrorReason, NameTakenPolicy};
use simd_client::{Client, Error, every_joint, slide};
use simd_tests::daemon::{Daemon, Via};

use crate::arm;
use crate::security::{guarded, of, of_second, options};

const MINUTE: Duration = Duration::from_secs(60);
const REPLACE: NameTakenPolicy = NameTakenPolicy::Replace;

async fn add(client: &Client, name: &str) -> Result<(), Error> {
    client.add_slider(name, (0.0, 1.0), 0.5, REPLACE).await.map(drop)
}

/// Whatever would replace or remove the saved state "mine" and the slider "gain".
async fn attempts(client: &Client) -> Vec<(&'static str, Result<(), Error>)> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("state");
    client.export_saved_state("mine", &file).await.unwrap();
    vec![
        ("save", client.save_state("mine").await.map(drop)),
        ("import", client.import_saved_state(&file, "mine").await.map(drop)),
        ("add", add(client, "gain").await),
        ("remove", client.remove_parameters(vec!["gain".into()]).await.map(drop)),
        ("delete", client.delete_saved_state("mine").await),
    ]
}

async fn refused(client: &Client, owner: &str) {
    for (what, outcome) in attempts(client).await {
        let error = outcome.expect_err(what);
        assert_eq!(error.reason(), Some(ErrorReason::OwnedByAnother), "{what}: {error}");
        assert!(error.to_string().contains(owner), "{what}: {error}");
    }
}

async fn allowed(client: &Client) {
    for (what, outcome) in attempts(client).await {
        assert!(outcome.is_ok(), "{what}: {outcome:?}");
    }
}

async fn items_made_with_a_claim_belong_to_its_holder_while_it_lasts(via: Via) {
    let daemon = arm(via).await;
    let other = daemon.another_client().await;
    let secret = daemon.client.claim_joints(vec![every_joint("arm")], "me", MINUTE).await.unwrap();
    let holder = daemon.client.clone().with_name("maker").with_claim(&secret);
    holder.save_state("mine").await.unwrap();
    add(&holder, "gain").await.unwrap();
    add(&other, "free").await.unwrap();

    refused(&other, "maker").await;
    // Without its claim the holder is like any client; the same holds with another client's claim.
    refused(&daemon.client, "maker").await;
    // Every client may read and move.
    other.set_parameters([slide("gain", 0.25)]).await.unwrap();
    other.restore_state("mine").await.unwrap_err();
    let removed = other.remove_parameters(Vec::new()).await.unwrap();
    assert_eq!(removed, ["free"], "all that are not another's");
    assert_eq!(holder.saved_states().await.unwrap().len(), 1);

    // The holder replaces and removes its own.
    allowed(&holder).await;
    holder.save_state("mine").await.unwrap();
    add(&holder, "gain").await.unwrap();
    // Without tokens any client that asks to can take over.
    allowed(&other.clone().taking_over()).await;

    holder.save_state("mine").await.unwrap();
    add(&holder, "gain").await.unwrap();
    refused(&other, "maker").await;
    holder.release_joints(&secret).await.unwrap();
    allowed(&other).await;
}

async fn items_made_without_a_claim_or_a_token_belong_to_all_and_name_their_maker(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let maker = daemon.client.clone().with_name("bench 1");
    let saved = maker.save_state("mine").await.unwrap();
    add(&maker, "gain").await.unwrap();
    let listed = daemon.client.saved_states().await.unwrap().remove(0);
    let slider = daemon.client.parameters(Vec::new()).await.unwrap().parameters.remove(0);
    for owner in [saved.owner, listed.owner, slider.owner] {
        assert!(owner.starts_with("bench 1"), "{owner}");
    }
    allowed(&daemon.another_client().await).await;
    // A state of that name, made by another, is that other's.
    daemon.client.clone().with_name("bench 2").save_state("mine").await.unwrap();
    let listed = daemon.client.saved_states().await.unwrap().remove(0);
    assert!(listed.owner.starts_with("bench 2"), "{}", listed.owner);
}

crate::over_every_transport![
    items_made_with_a_claim_belong_to_its_holder_while_it_lasts,
    items_made_without_a_claim_or_a_token_belong_to_all_and_name_their_maker,
];

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn items_made_with_a_token_belong_to_its_owner_until_an_admin_takes_over() {
    let guarded = guarded(|config, _| config.driver.state = simd_world::handle::RunState::Paused).await;
    for place in [guarded.grpc(), guarded.running.locators()[0].clone()] {
        let connect = async |token| Client::connect_with(&place, options(Some(token), None)).await.unwrap();
        let admin = connect(of(Role::Admin)).await;
        let (second, operator) = (connect(of_second()).await, connect(of(Role::Operator)).await);
        admin.save_state("mine").await.unwrap();
        add(&admin, "gain").await.unwrap();
        assert_eq!(admin.saved_states().await.unwrap()[0].owner, "admin");
        refused(&second, "belongs to admin").await;
        let lowly = add(&operator, "gain").await.unwrap_err();
        assert_eq!(lowly.reason(), Some(ErrorReason::OwnedByAnother), "{lowly}");
        for takes_over in [
            add(&operator.clone().taking_over(), "gain").await,
            operator.clone().taking_over().remove_parameters(Vec::new()).await.map(drop),
        ] {
            assert_eq!(takes_over.unwrap_err().reason(), Some(ErrorReason::RoleTooLow));
        }
        let claim = ClaimJointsRequest { take_over: true, ..ClaimJointsRequest::default() };
        assert_eq!(operator.claim(claim).await.unwrap_err().reason(), Some(ErrorReason::RoleTooLow));
        // Another connection with the same token is the same owner.
        allowed(&connect(of(Role::Admin)).await).await;
        admin.save_state("mine").await.unwrap();
        add(&admin, "gain").await.unwrap();
        allowed(&second.taking_over()).await;
    }
}
