//! The file of tokens: what it must be, its changes while the daemon runs, and guesses of tokens.

use std::path::PathBuf;

use simd_client::access::{Role, token, write_tokens};
use simd_client::proto::ErrorReason;
use simd_client::{Target, joint_target};
use simd_server::config::Config;
use simd_server::daemon;
use simd_tests::process::soon;
use tempfile::TempDir;
use tonic::Code;

use crate::security::{call_over, channel, entries, entry, guarded, of, write};

#[tokio::test(flavor = "multi_thread")]
async fn a_revoked_token_ends_streams_and_a_new_one_is_taken_without_a_restart() {
    let guarded = guarded(|_, _| {}).await;
    let viewer = guarded.client(&of(Role::Viewer)).await;
    let mut watch = viewer.watch_events(0).await.unwrap();
    let other = token(&[11; 32]);
    let mut tokens: Vec<_> = entries().into_iter().filter(|entry| entry.role != Role::Viewer).collect();
    tokens.push(entry("other", Role::Viewer, &other, None));
    guarded.rewrite(&tokens);
    let ended = loop {
        match watch.next().await {
            Ok(Some(_)) => {}
            Ok(None) => break None,
            Err(error) => break Some(error),
        }
    };
    assert_eq!(ended.and_then(|error| error.reason()), Some(ErrorReason::Unauthenticated));
    assert_eq!(viewer.robots().await.unwrap_err().reason(), Some(ErrorReason::Unauthenticated));
    guarded.client(&other).await.robots().await.unwrap();
    // A damaged file changes nothing.
    write(&guarded.folder.path().join("tokens"), "nonsense");
    tokio::task::yield_now().await;
    guarded.client(&other).await.robots().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_revoked_token_ends_the_claims_that_it_took() {
    let guarded = guarded(|_, _| {}).await;
    let admin = guarded.client(&of(Role::Admin)).await;
    crate::load_arm(&admin, "arm").await;
    let operator = guarded.client(&of(Role::Operator)).await;
    let hour = std::time::Duration::from_secs(3600);
    operator.claim_joints(vec![simd_client::every_joint("arm")], "operator", hour).await.unwrap();
    let target = || [joint_target("shoulder", Target::position(0.1))];
    admin.set_robot_targets("arm", target()).await.unwrap_err();
    let left: Vec<_> = entries().into_iter().filter(|entry| entry.role != Role::Operator).collect();
    guarded.rewrite(&left);
    let free = async { while admin.set_robot_targets("arm", target()).await.is_err() {} };
    soon("the end of the claim", free).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_file_of_tokens_that_was_emptied_changes_nothing() {
    let guarded = guarded(|_, _| {}).await;
    let admin = guarded.client(&of(Role::Admin)).await;
    write(&guarded.folder.path().join("tokens"), "");
    // Looked at again by the time that another change is.
    guarded.running.handle.access().look();
    admin.robots().await.unwrap();
}

#[tokio::test]
async fn a_daemon_does_not_start_with_tokens_that_others_can_read() {
    let folder = TempDir::new().unwrap();
    let tokens = folder.path().join("tokens");
    let start = async |tokens: PathBuf| {
        let zenoh = simd_server::config::Zenoh::off();
        let listen = std::net::SocketAddr::from(([127, 0, 0, 1], 0));
        let config = Config { listen, zenoh, tokens: Some(tokens), ..Config::default() };
        daemon::start(config).await.map(drop).map_err(|error| (error.exit_code(), error.to_string()))
    };
    let (code, sentence) = start(tokens.clone()).await.unwrap_err();
    assert!(code == 3 && sentence.contains("cannot be read"), "{sentence}");
    write(&tokens, "alice king");
    assert!(start(tokens.clone()).await.unwrap_err().1.contains("line 1"));
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        write(&tokens, "");
        std::fs::set_permissions(&tokens, std::fs::Permissions::from_mode(0o640)).unwrap();
        assert!(start(tokens.clone()).await.unwrap_err().1.contains("chmod 600"));
    }
    write(&tokens, "");
    let empty = start(tokens.clone()).await.unwrap_err().1;
    assert!(empty.contains("it is empty"), "{empty}");
    write(&tokens, &write_tokens(&entries()));
    start(tokens).await.unwrap();
}

/// A wrong token takes nothing from a right one, also over the same connection.
#[tokio::test(flavor = "multi_thread")]
async fn refusals_of_wrong_tokens_are_counted_and_slow_down() {
    let guarded = guarded(|_, _| {}).await;
    let channel = channel(&guarded.running).await;
    let path = "/simd.v1.SimulationService/GetPhysics";
    let call = async |token: &str| call_over(channel.clone(), path, Some(token)).await.code();
    let before = std::time::Instant::now();
    for _ in 0..6 {
        assert_eq!(call(&token(&[77; 32])).await, Code::Unauthenticated);
    }
    // The sixth waits for half a second, which a machine cannot make shorter.
    assert!(before.elapsed() >= std::time::Duration::from_millis(400), "{:?}", before.elapsed());
    assert_eq!(call(&of(Role::Viewer)).await, Code::Ok);
    assert_eq!(guarded.running.handle.access().wrong_tokens(), 6);
}
