//! Draining of a daemon.

use tokio_stream::wrappers::ReceiverStream;
use tonic_health::pb::HealthCheckRequest;
use tonic_health::pb::health_check_response::ServingStatus;
use tonic_health::pb::health_client::HealthClient;

use super::*;

#[tokio::test]
async fn every_stream_ends_with_ok_and_the_server_returns() {
    let mut daemon = Daemon::start(RunState::Paused).await;
    let (requests, receiver) = tokio::sync::mpsc::channel(1);
    let mut control = daemon.joints().control(ReceiverStream::new(receiver)).await.unwrap().into_inner();
    requests.send(v1::ControlRequest::default()).await.unwrap();
    control.message().await.unwrap().unwrap();

    let mut states = daemon
        .joints()
        .watch_joint_states(v1::WatchJointStatesRequest::default())
        .await
        .unwrap()
        .into_inner();
    states.message().await.unwrap().unwrap();
    let mut events =
        daemon.events().watch_events(v1::WatchEventsRequest::default()).await.unwrap().into_inner();
    let mut health = HealthClient::new(daemon.channel.clone())
        .watch(HealthCheckRequest { service: String::new() })
        .await
        .unwrap()
        .into_inner();
    assert_eq!(health.message().await.unwrap().unwrap().status(), ServingStatus::Serving);

    daemon.handle.draining().cancel();
    assert_eq!(control.message().await.unwrap(), None);
    assert_eq!(states.message().await.unwrap(), None);
    assert_eq!(events.message().await.unwrap(), None);
    assert_eq!(health.message().await.unwrap().unwrap().status(), ServingStatus::NotServing);
    assert_eq!(health.message().await.unwrap(), None);
    (&mut daemon.server).await.unwrap();
}

#[tokio::test]
async fn a_call_that_waits_learns_that_the_daemon_goes_down() {
    let daemon = Daemon::start(RunState::Paused).await;
    let newest = daemon.handle.newest().sequence;
    let request = v1::NextJointStatesRequest { after_sequence: newest, timeout: 60.0, ..Default::default() };
    let mut joints = daemon.joints();
    let (answer, ()) = tokio::join!(joints.next_joint_states(request), async {
        // The call is on its way before the one that this waits for.
        daemon.simulation().get_physics(v1::GetPhysicsRequest {}).await.unwrap();
        daemon.handle.draining().cancel();
    });
    assert_eq!(reason(&answer.unwrap_err()), "SHUTTING_DOWN");
}

#[tokio::test]
async fn a_stream_that_a_client_holds_open_does_not_hold_the_server() {
    use tonic_reflection::pb::v1::server_reflection_client::ServerReflectionClient;
    let mut daemon = Daemon::start(RunState::Paused).await;
    let (_requests, receiver) = tokio::sync::mpsc::channel(1);
    let mut client = ServerReflectionClient::new(daemon.channel.clone());
    let _held = client.server_reflection_info(ReceiverStream::new(receiver)).await.unwrap();
    tokio::time::pause();
    daemon.handle.draining().cancel();
    (&mut daemon.server).await.unwrap();
}
