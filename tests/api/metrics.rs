//! Metrics and the health of the daemon, for operators.

use std::time::Instant;

use simd_client::proto::entity_service_client::EntityServiceClient;
use simd_client::{every_joint, proto};
use simd_model::robot::Sha256;
use simd_tests::daemon::{Daemon, Via};
use simd_tests::http::{get, send};
use tonic::transport::Channel;

use crate::arm;

/// Returns the value of a sample by its name and labels, as the text has them.
fn sample(text: &str, name: &str) -> Option<f64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' '))?;
    Some(line.parse().unwrap())
}

#[tokio::test]
async fn metrics_count_steps_calls_and_refusals() {
    let daemon = arm(Via::Grpc).await;
    daemon.client.step(25).await.unwrap();
    daemon.client.delete_robot("missing").await.unwrap_err();
    daemon.client.delete_robot("missing").await.unwrap_err();
    let stream = daemon.client.watch(vec![every_joint("arm")], 10.0).await.unwrap();
    let answer = get(daemon.address, "/metrics", &[]).await;
    assert_eq!(answer.status, 200);
    let text = answer.text();
    let value = |name: &str| sample(&text, name).unwrap_or_else(|| panic!("{name} is not in\n{text}"));
    assert_eq!(value("simd_steps_total"), 25.0);
    assert_eq!(value("simd_step_duration_seconds_count"), 25.0);
    assert_eq!(value("simd_step_duration_seconds_bucket{le=\"+Inf\"}"), 25.0);
    assert_eq!(value("simd_robots"), 1.0);
    assert_eq!(value("simd_simulation_state{state=\"paused\"}"), 1.0);
    let refused = "method=\"EntityService/DeleteEntity\",transport=\"grpc\",code=\"NotFound\",reason=\"ROBOT_NOT_FOUND\"";
    assert_eq!(value(&format!("simd_calls_total{{{refused}}}")), 2.0);
    let stepped = "method=\"SimulationService/StepSimulation\",transport=\"grpc\"";
    assert_eq!(value(&format!("simd_calls_total{{{stepped},code=\"Ok\",reason=\"\"}}")), 1.0);
    assert_eq!(value(&format!("simd_call_duration_seconds_count{{{stepped}}}")), 1.0);
    assert_eq!(value("simd_streams{method=\"JointService/WatchJointStates\",transport=\"grpc\"}"), 1.0);
    assert!(value("process_open_fds") > 3.0);
    drop(stream);
}

/// The rules of `promtool check metrics`, for readers that do not ask for OpenMetrics.
#[tokio::test]
async fn metrics_come_in_the_format_that_is_asked_for() {
    let daemon = arm(Via::Grpc).await;
    daemon.client.step(2).await.unwrap();
    for accept in
        ["application/openmetrics-text", "text/html, Application/OpenMetrics-Text;version=1.0.0;q=0.5"]
    {
        let answer = get(daemon.address, "/metrics", &[("Accept", accept)]).await;
        assert!(answer.header("content-type").starts_with("application/openmetrics-text"), "{accept}");
        assert!(answer.text().ends_with("# EOF\n"), "{accept}");
    }
    let none: &[(&str, &str)] = &[];
    for headers in [none, &[("Accept", "text/plain;version=0.0.4, */*;q=0.1")]] {
        let answer = get(daemon.address, "/metrics", headers).await;
        assert_eq!(answer.header("content-type"), "text/plain; version=0.0.4; charset=utf-8");
        let text = answer.text();
        let (mut helped, mut family) = (String::new(), (String::new(), String::new()));
        let mut families = std::collections::BTreeSet::new();
        for line in text.lines() {
            let words: Vec<&str> = line.splitn(4, ' ').collect();
            match words[..] {
                ["#", "HELP", name, help] => {
                    assert!(!help.is_empty(), "{line}");
                    name.clone_into(&mut helped);
                }
                ["#", "TYPE", name, kind] => {
                    assert_eq!(helped, name, "a family has a text");
                    assert!(families.insert(name.to_owned()), "{name} comes twice");
                    assert_eq!(kind == "counter", name.ends_with("_total"), "{line}");
                    family = (name.to_owned(), kind.to_owned());
                }
                [sample, ..] => {
                    let name = sample.split('{').next().unwrap();
                    let suffix = name
                        .strip_prefix(&*family.0)
                        .unwrap_or_else(|| panic!("{line} is not of {family:?}"));
                    let suffixes: &[&str] =
                        if family.1 == "histogram" { &["_bucket", "_sum", "_count"] } else { &[""] };
                    assert!(suffixes.contains(&suffix), "{line} is not of {family:?}");
                }
                [] => panic!("an empty line"),
            }
        }
        assert!(families.len() > 20, "{families:?}");
    }
}

/// A caller that disconnects while it sends looks like that: nothing was refused.
#[tokio::test]
async fn a_call_that_ends_before_its_message_counts_as_cancelled() {
    let daemon = arm(Via::Grpc).await;
    let path = "/simd.v1.EntityService/PrepareDescription";
    let headers = [("Content-Type", "application/grpc-web+proto")];
    let answer = send(daemon.address, "POST", path, &headers, &[]).await;
    assert_eq!(answer.header("grpc-status"), "1", "{}", answer.text());
    let text = get(daemon.address, "/metrics", &[]).await.text();
    let of = "method=\"EntityService/PrepareDescription\",transport=\"grpc-web\"";
    assert_eq!(
        sample(&text, &format!("simd_calls_total{{{of},code=\"Cancelled\",reason=\"\"}}")),
        Some(1.0),
        "{text}"
    );
}

/// Until the rest has come.
#[tokio::test]
async fn a_part_of_an_upload_is_seen_with_its_bytes_until_the_rest_has_come() {
    let daemon = arm(Via::Grpc).await;
    let endpoint = Channel::from_shared(format!("http://{}", daemon.address)).unwrap();
    let mut entities = EntityServiceClient::new(endpoint.connect().await.unwrap());
    let shown = async || {
        let text = get(daemon.address, "/metrics", &[]).await.text();
        ["simd_uploads", "simd_upload_bytes"].map(|name| sample(&text, name))
    };
    assert_eq!(shown().await, [Some(0.0); 2]);
    let file = b"a file in two parts";
    for (part, seen) in [(0..8, [Some(1.0), Some(8.0)]), (8..file.len(), [Some(0.0); 2])] {
        let request = proto::UploadAssetRequest {
            sha256: Sha256::of(file).to_string(),
            total_bytes: file.len() as u64,
            offset: part.start as u64,
            data: file[part].to_vec(),
        };
        entities.upload_asset(request).await.unwrap();
        assert_eq!(shown().await, seen);
    }
}

async fn the_same_counts_are_asked_for_over_every_transport(via: Via) {
    let daemon = arm(via).await;
    let (_, Some(before)) = daemon.client.daemon_statistics().await.unwrap() else { panic!() };
    daemon.client.step(25).await.unwrap();
    daemon.client.delete_robot("missing").await.unwrap_err();
    let claim =
        proto::ClaimJointsRequest { world: true, lease: 60.0, holder: "us".into(), ..Default::default() };
    daemon.client.claim(claim).await.unwrap();
    let (world, Some(after)) = daemon.client.daemon_statistics().await.unwrap() else { panic!() };
    assert_eq!(world.iterations, 25);
    // The question itself, a step, a refusal and a claim.
    assert_eq!((after.calls - before.calls, after.failed_calls - before.failed_calls), (4, 1));
    assert_eq!((before.claims, after.claims), (0, 1));
    let (before, after) = (before.step_duration.unwrap(), after.step_duration.unwrap());
    assert_eq!(before.upper_bounds, after.upper_bounds);
    assert!(after.upper_bounds.is_sorted() && after.upper_bounds.last() == Some(&f64::INFINITY));
    assert_eq!(after.counts.iter().sum::<u64>() - before.counts.iter().sum::<u64>(), 25);
    assert!(after.sum > before.sum);
}

crate::over_every_transport![the_same_counts_are_asked_for_over_every_transport,];

#[tokio::test]
async fn a_daemon_that_drains_is_alive_and_not_ready() {
    let daemon = Daemon::paused().await;
    for path in ["/healthz", "/readyz"] {
        let answer = get(daemon.address, path, &[]).await;
        assert_eq!((answer.status, answer.text()), (200, "ok\n".to_owned()), "{path}");
    }
    daemon.running.handle.draining().cancel();
    assert_eq!(daemon.running.handle.health(Instant::now()), Ok(()));
    assert!(daemon.running.handle.readiness(Instant::now()).unwrap_err().contains("shutting down"));
}

/// All metrics that the dashboard uses exist under these names.
#[tokio::test]
async fn the_dashboard_asks_for_metrics_that_there_are() {
    // The program counts its allocations; this test process does not.
    simd_world::process::count_heap_by(|| 1);
    let daemon = arm(Via::Grpc).await;
    let stream = daemon.client.watch(vec![every_joint("arm")], 10.0).await.unwrap();
    let text = get(daemon.address, "/metrics", &[]).await.text();
    let dashboard = include_str!("../../docs/grafana.json");
    let is_of_name = |c: char| c.is_ascii_lowercase() || c == '_';
    let words = dashboard
        .split(|c| !is_of_name(c))
        .filter(|word| word.starts_with("simd_") || word.starts_with("process_"));
    let asked: std::collections::BTreeSet<&str> = words.collect();
    assert!(asked.len() > 10, "{asked:?}");
    for name in asked {
        let is_there =
            text.lines().any(|line| line.strip_prefix(name).is_some_and(|rest| rest.starts_with(['{', ' '])));
        assert!(is_there, "{name} is not in\n{text}");
    }
    drop(stream);
}
