//! Clients of another version, and input of no client at all: nothing kills the daemon.

use simd_client::proto::simulation_service_client::SimulationServiceClient;
use simd_client::proto::{
    ErrorReason, GetSimulatorInfoRequest, GetWorldStatisticsRequest, PrepareDescriptionRequest,
    SpawnEntityRequest, UploadAssetRequest, entity_service_client::EntityServiceClient,
};
use simd_client::{Code, Package};
use simd_tests::process::{Process, soon};
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpStream;
use tonic::Request;
use tonic::transport::Channel;
use tonic_types::StatusExt as _;

use crate::paused;

async fn channel(daemon: &Process) -> Channel {
    Channel::from_shared(daemon.endpoint.clone()).unwrap().connect().await.unwrap()
}

fn from_version<T>(version: &'static str, message: T) -> Request<T> {
    let mut request = Request::new(message);
    request.metadata_mut().insert("simd-api-version", version.parse().unwrap());
    request
}

#[tokio::test]
async fn a_client_of_another_version_learns_which_side_is_older() {
    let daemon = paused().await;
    let mut client = SimulationServiceClient::new(channel(&daemon).await);
    for (version, sentence) in [
        ("2.0", "client speaks simd API 2.0, this daemon speaks 1.0; the daemon is older: update the daemon"),
        (
            "1.99",
            "client speaks simd API 1.99, this daemon speaks 1.0; the daemon is older: update the daemon",
        ),
        ("0.9", "client speaks simd API 0.9, this daemon speaks 1.0; the client is older: update the client"),
    ] {
        let refused = client
            .get_world_statistics(from_version(version, GetWorldStatisticsRequest::default()))
            .await
            .unwrap_err();
        assert_eq!(refused.code(), Code::FailedPrecondition);
        assert_eq!(refused.message(), sentence);
        assert_eq!(refused.get_details_error_info().unwrap().reason, "VERSION_MISMATCH");
        // A client that is refused can still ask which daemon refuses.
        let info = client
            .get_simulator_info(from_version(version, GetSimulatorInfoRequest {}))
            .await
            .unwrap()
            .into_inner();
        assert_eq!((info.api_major, info.api_minor), (1, 0));
    }
    let unsaid = client.get_world_statistics(GetWorldStatisticsRequest::default()).await;
    assert!(unsaid.is_ok(), "a client that says no version, such as grpcurl, is served");
}

/// Sends bytes and reads until the daemon has enough of it.
async fn throw(daemon: &Process, bytes: &[u8]) -> Vec<u8> {
    let mut stream = TcpStream::connect(daemon.address()).await.unwrap();
    // The daemon may close before it has read all of it.
    let _ = stream.write_all(bytes).await;
    let _ = stream.shutdown().await;
    let mut answer = Vec::new();
    let _ = soon("the end of a connection", stream.read_to_end(&mut answer)).await;
    answer
}

#[tokio::test]
async fn bytes_that_are_no_grpc_do_not_kill_the_daemon() {
    let daemon = paused().await;
    let client = daemon.client().await;
    let mut random = fastrand::Rng::with_seed(1);
    const PREFACE: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
    for length in [0, 1, 9, 100, 10_000, 1_000_000] {
        let garbage: Vec<u8> = (0..length).map(|_| random.u8(..)).collect();
        throw(&daemon, &garbage).await;
        throw(&daemon, &[PREFACE, &garbage].concat()).await;
        client.world_statistics().await.unwrap();
    }
    for request in
        ["GET / HTTP/1.1\r\nHost: simd\r\n\r\n", "POST /simd.v1.JointService/Control HTTP/1.0\r\n\r\n"]
    {
        throw(&daemon, request.as_bytes()).await;
        client.world_statistics().await.unwrap();
    }
    // A connection that only opens, and one that is dropped amid the preface.
    let silent = TcpStream::connect(daemon.address()).await.unwrap();
    let mut rude = TcpStream::connect(daemon.address()).await.unwrap();
    rude.write_all(&PREFACE[..10]).await.unwrap();
    drop(rude);
    assert_eq!(daemon.simctl(["server", "ping", "--count", "1"]).await.code, 0);
    drop(silent);
}

#[tokio::test]
async fn messages_that_make_no_sense_are_refused_and_do_not_kill_the_daemon() {
    let daemon = paused().await;
    let client = daemon.client().await;
    let mut raw = EntityServiceClient::new(channel(&daemon).await);
    let reason = |refused: tonic::Status| refused.get_details_error_info().map(|info| info.reason);

    let urdf = vec![b' '; 17 << 20];
    let too_long = PrepareDescriptionRequest { urdf, ..Default::default() };
    let refused = raw.prepare_description(too_long).await.unwrap_err();
    assert_eq!(refused.code(), Code::ResourceExhausted, "{refused:?}");
    assert_eq!(reason(refused).as_deref(), Some("LIMIT_EXCEEDED"));
    client.world_statistics().await.unwrap();

    for urdf in [
        &b"\0\0\0\0"[..],
        b"<robot",
        b"<robot name='r'><link name='a'></robot>",
        b"\xff\xfe<\0",
        b"<robot name='r'>",
    ] {
        let folder = tempfile::TempDir::new().unwrap();
        let path = folder.path().join("arm.urdf");
        std::fs::write(&path, urdf).unwrap();
        let package = Package::open(&path).unwrap();
        let refused = client.upload(&package).await.unwrap_err();
        assert_eq!(refused.reason(), Some(ErrorReason::InvalidDescription), "{urdf:?}: {refused}");
    }
    let deep = "<a>".repeat(200_000);
    let refused = raw
        .prepare_description(PrepareDescriptionRequest { urdf: deep.into(), ..Default::default() })
        .await
        .unwrap_err();
    assert_eq!(reason(refused).as_deref(), Some("INVALID_DESCRIPTION"));

    let no_urdf = raw.prepare_description(PrepareDescriptionRequest::default()).await.unwrap_err();
    assert_eq!(reason(no_urdf).as_deref(), Some("INVALID_VALUE"));
    let empty = UploadAssetRequest::default();
    assert_eq!(reason(raw.upload_asset(empty).await.unwrap_err()).as_deref(), Some("INVALID_VALUE"));
    let nothing = SpawnEntityRequest::default();
    assert_eq!(reason(raw.spawn_entity(nothing).await.unwrap_err()).as_deref(), Some("INVALID_VALUE"));

    assert_eq!(daemon.simctl(["server", "ping", "--count", "1"]).await.code, 0);
    let robots = client.robots().await.unwrap();
    assert_eq!(robots.len(), 1, "the world is as it was");
}
