//! Audit events, for watchers over every transport.

use std::time::Duration;

use simd_client::access::{Role, token};
use simd_client::proto::event::Kind;
use simd_client::proto::{AuditedCall, ErrorReason};
use simd_client::{Client, Error, Target, joint_target};

use crate::security::{guarded, of, options};

/// Returns the last that was audited; others come at once or not at all.
async fn audited(client: &Client, after: u64) -> (Vec<AuditedCall>, u64) {
    let batch = client.next_events(after, Duration::ZERO).await.unwrap();
    let calls = batch.events.into_iter().filter_map(|event| match event.kind {
        Some(Kind::AuditedCall(call)) => Some(call),
        _ => None,
    });
    (calls.collect(), batch.last_sequence)
}

/// Returns the compared fields.
fn of_calls(calls: &[AuditedCall]) -> Vec<(&str, &str, Vec<&str>, &str)> {
    calls
        .iter()
        .map(|call| {
            let robots = call.robots.iter().map(String::as_str).collect();
            let reason = call.reason().as_str_name().trim_start_matches("ERROR_REASON_");
            (call.token.as_str(), call.method.as_str(), robots, reason)
        })
        .collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn each_call_that_changes_something_is_an_event_with_its_robots_and_its_result() {
    let guarded = guarded(|config, _| config.driver.state = simd_world::handle::RunState::Paused).await;
    for (place, transport) in [(guarded.grpc(), "grpc"), (guarded.running.locators()[0].clone(), "zenoh")] {
        let connect = async |token| Client::connect_with(&place, options(Some(token), None)).await.unwrap();
        let admin = connect(of(Role::Admin)).await.with_name("console");
        let viewer = connect(of(Role::Viewer)).await;
        let (_, begun) = audited(&viewer, 0).await;

        crate::load_arm(&admin, "arm").await;
        admin.set_robot_targets("arm", [joint_target("shoulder", Target::position(0.1))]).await.unwrap();
        let refused: Result<_, Error> = admin.delete_robot("missing").await;
        assert_eq!(refused.unwrap_err().reason(), Some(ErrorReason::RobotNotFound));
        admin.save_state("it").await.unwrap();
        viewer.delete_robot("arm").await.unwrap_err();
        viewer.robots().await.unwrap();
        let unknown = Client::connect_with(&place, options(Some(token(&[8; 32])), None)).await;
        if let Ok(unknown) = unknown {
            unknown.delete_robot("arm").await.unwrap_err();
        }
        admin.delete_robot("arm").await.unwrap();

        // The uploads of a robot, its text and its files, come before these.
        let (calls, _) = audited(&viewer, begun).await;
        let rows = of_calls(&calls);
        let loads = rows.iter().take_while(|(_, method, ..)| !method.contains("SpawnEntity")).count();
        for (token, method, _, reason) in &rows[..loads] {
            assert!(method.contains("PrepareDescription") || method.contains("UploadAsset"), "{method}");
            assert_eq!((*token, *reason), ("admin", "UNSPECIFIED"));
        }
        let expected = [
            ("admin", "EntityService/SpawnEntity", vec!["arm"], "UNSPECIFIED"),
            ("admin", "EntityService/DeleteEntity", vec!["missing"], "ROBOT_NOT_FOUND"),
            ("admin", "SimulationService/SaveState", vec![], "UNSPECIFIED"),
            ("viewer", "EntityService/DeleteEntity", vec![], "ROLE_TOO_LOW"),
            ("admin", "EntityService/DeleteEntity", vec!["arm"], "UNSPECIFIED"),
        ];
        assert_eq!(rows[loads..], expected, "{transport}");
        let last = calls.last().unwrap();
        assert_eq!((last.client.as_str(), last.transport.as_str(), last.code), ("console", transport, 0));
        // A Zenoh query need not name its session.
        assert!(!last.peer.is_empty() || transport == "zenoh");
        admin.delete_saved_state("it").await.unwrap();
    }
}

/// An unknown caller cannot push events out of the log; a known caller without permission adds at most a few
/// events a second.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_flood_of_refusals_leaves_the_events_of_others() {
    let guarded = guarded(|_, _| {}).await;
    let viewer = guarded.client(&of(Role::Viewer)).await;
    let admin = guarded.client(&of(Role::Admin)).await;
    admin.save_state("before").await.unwrap();
    let begun = tokio::time::Instant::now();
    for _ in 0..300 {
        viewer.delete_robot("arm").await.unwrap_err();
    }
    let seconds = begun.elapsed().as_secs() + 2;
    let (calls, _) = audited(&viewer, 0).await;
    assert!(calls.iter().any(|call| call.method.ends_with("/SaveState")), "{calls:?}");
    let refused = calls.iter().filter(|call| call.reason() == ErrorReason::RoleTooLow).count() as u64;
    assert!(refused > 0 && refused <= 10 * seconds, "{refused} in {seconds} s");
}
