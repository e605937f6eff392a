//! Findings about daemons with one fault each.

use std::collections::BTreeMap;

use simd_client::Code;

use super::super::Level;
use super::*;

fn now() -> SystemTime {
    SystemTime::UNIX_EPOCH + Duration::from_secs(1_000_000)
}

#[test]
fn an_address_is_read_as_the_client_reads_it() {
    for (endpoint, is_tls, host, port) in [
        ("lab", false, "lab", DEFAULT_PORT),
        ("lab:1", false, "lab", 1),
        ("http://127.0.0.1:7400", false, "127.0.0.1", 7400),
        ("https://[::1]:9/", true, "::1", 9),
        ("[::1]", false, "::1", DEFAULT_PORT),
    ] {
        let expected = Address { is_tls, host: host.into(), port };
        assert_eq!(Address::read(endpoint), Some(expected), "{endpoint}");
    }
    assert_eq!(Address::read("lab:many"), None);
    assert_eq!(Address::read("ftp://lab"), None);
    for (endpoint, is) in [
        ("127.0.0.9:1", true),
        ("https://localhost", true),
        ("[::1]:7400", true),
        ("tcp/127.0.0.1:7447#simd", true),
        ("tcp/10.0.0.1:7447", false),
        ("10.0.0.1", false),
        ("localhost.example", false),
    ] {
        assert_eq!(is_loopback(endpoint), is, "{endpoint}");
    }
}

#[test]
fn another_version_is_a_warning_and_another_api_a_problem() {
    let info = |version: &str, api_major, api_minor| GetSimulatorInfoResponse {
        version: version.into(),
        api_major,
        api_minor,
        ..Default::default()
    };
    let own = env!("CARGO_PKG_VERSION");
    assert_eq!(versions(&info(own, API_VERSION.major, API_VERSION.minor)).level, Level::Ok);
    assert_eq!(versions(&info("99.0.0", API_VERSION.major, API_VERSION.minor)).level, Level::Warning);
    assert_eq!(versions(&info(own, API_VERSION.major + 1, 0)).level, Level::Problem);
}

#[test]
fn a_token_has_a_role_and_a_time() {
    let known = |left: Option<i64>| TokenInfo {
        name: "alice".into(),
        role: "operator".into(),
        expires: left.map(|left| prost_types::Timestamp { seconds: 1_000_000 + left, nanos: 0 }),
    };
    let source = Some(Source::Environment);
    let found = token(Some(&known(Some(30 * 86_400))), source, false, now());
    assert_eq!(
        found,
        Finding::ok("token", "the token of alice, from SIMD_TOKEN: operator, expires in 30 days")
    );
    assert_eq!(token(Some(&known(None)), source, false, now()).level, Level::Ok);
    assert_eq!(token(Some(&known(Some(3_600))), source, false, now()).level, Level::Warning);
    assert_eq!(token(Some(&known(None)), source, true, now()).level, Level::Warning);
    assert_eq!(token(None, None, true, now()).level, Level::Warning);
    assert_eq!(token(None, None, false, now()).level, Level::Ok);
    let refusal = Refusal {
        code: Code::Unauthenticated,
        reason: ErrorReason::Unauthenticated,
        message: "the token of bob has expired".into(),
        metadata: BTreeMap::new(),
        fields: Vec::new(),
    };
    let found = unauthenticated(&refusal, source);
    assert!(found.level == Level::Problem && found.found.contains("bob has expired"), "{found:?}");
    assert!(unauthenticated(&refusal, None).found.contains("none is given"));
}

#[test]
fn clocks_that_are_apart_are_found_however_slow_the_answer() {
    let daemon = |seconds: i64, nanos| DaemonStatistics {
        wall_time: Some(prost_types::Timestamp { seconds: 1_000_000 + seconds, nanos }),
        ..Default::default()
    };
    let skew = |daemon: &DaemonStatistics, took| clock(daemon, now(), Duration::from_secs(took)).unwrap();
    assert_eq!(skew(&daemon(0, 900_000_000), 0).level, Level::Ok);
    assert_eq!(skew(&daemon(3, 0), 4).level, Level::Ok, "it took four seconds to answer");
    let ahead = skew(&daemon(3, 0), 1);
    assert!(ahead.level == Level::Warning && ahead.found.contains("2.000 s ahead"), "{ahead:?}");
    let behind = skew(&daemon(-3, 500_000_000), 1);
    assert!(behind.level == Level::Warning && behind.found.contains("2.500 s behind"), "{behind:?}");
    assert_eq!(clock(&DaemonStatistics::default(), now(), Duration::ZERO), None);
}

#[test]
fn a_world_that_is_late_is_a_warning() {
    let playing = WorldStatistics {
        state: SimulationState::Playing.into(),
        target_real_time_factor: 1.0,
        real_time_factor: 1.0,
        ..Default::default()
    };
    assert_eq!(world(&playing).level, Level::Ok);
    assert_eq!(world(&WorldStatistics { real_time_factor: 0.5, ..playing.clone() }).level, Level::Warning);
    assert_eq!(world(&WorldStatistics { overruns: 1, ..playing.clone() }).level, Level::Warning);
    let paused =
        WorldStatistics { state: SimulationState::Paused.into(), real_time_factor: 0.0, ..playing.clone() };
    assert_eq!(world(&paused).level, Level::Ok);
    let fast = WorldStatistics { target_real_time_factor: f64::INFINITY, real_time_factor: 7.0, ..playing };
    assert_eq!(world(&fast).level, Level::Ok);
}

#[test]
fn cameras_without_a_renderer_are_a_warning() {
    use simd_client::proto::{CameraInfo, RendererInfo};
    let of = |count: usize, renderers: usize| {
        let (cameras, renderers) =
            (vec![CameraInfo::default(); count], vec![RendererInfo::default(); renderers]);
        cameras_of(&ListCamerasResponse { cameras, renderers, ..ListCamerasResponse::default() })
    };
    assert_eq!(of(0, 0), None);
    let dark = of(10, 0).unwrap();
    assert_eq!(
        (dark.level, dark.found.as_str()),
        (Level::Warning, "10 cameras, and no renderer: they have no pictures")
    );
    assert!(dark.advice.unwrap().contains("simd-camera --endpoint"));
    let drawn = of(10, 2).unwrap();
    assert_eq!((drawn.level, drawn.found.as_str()), (Level::Ok, "10 cameras and 2 renderers"));
}

#[tokio::test]
async fn an_empty_port_and_one_of_another_program_are_distinguished() {
    let options = ConnectOptions { timeout: Duration::from_secs(1), ..ConnectOptions::default() };
    let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
    let endpoint = listener.local_addr().unwrap().to_string();
    // It closes each connection, like a server with another protocol.
    let other = tokio::spawn(async move {
        loop {
            drop(listener.accept().await);
        }
    });
    let last = |seen: Seen| seen.findings.last().cloned().unwrap();
    let taken = last(over_grpc(&endpoint, &options, None, now()).await);
    assert!(taken.level == Level::Problem && taken.found.contains("another program"), "{taken:?}");
    let tls = last(over_grpc(&format!("https://{endpoint}"), &options, None, now()).await);
    assert!(tls.level == Level::Problem && tls.found.contains("does not use TLS"), "{tls:?}");
    other.abort();
    let _ = other.await;
    let empty = last(over_grpc(&endpoint, &options, None, now()).await);
    assert!(empty.level == Level::Problem && empty.found.contains("nothing listens"), "{empty:?}");
    assert_eq!(last(over_grpc("lab:x", &options, None, now()).await).check, "endpoint");
}
