//! A world within the process, called by bytes.

use prost::Message as _;
use simd_proto::v1;

use super::*;
use simd_world::handle::RunState;

const SECOND: Duration = Duration::from_secs(10);

fn world(change: impl FnOnce(&mut Config)) -> Embedded {
    let mut config = Config::default();
    config.driver.state = RunState::Paused;
    change(&mut config);
    Embedded::start(config, "1.0", "test").unwrap()
}

fn call<A: prost::Message + Default>(
    world: &Embedded,
    method: &str,
    request: &impl prost::Message,
) -> Result<A, Status> {
    let answer = world.call(method, request.encode_to_vec().into(), SECOND, || true)?;
    Ok(A::decode(answer).unwrap())
}

fn step(world: &Embedded, steps: u64) -> Result<u64, Status> {
    let request = v1::StepSimulationRequest { steps, ..v1::StepSimulationRequest::default() };
    let answer: v1::StepSimulationResponse = call(world, "SimulationService/StepSimulation", &request)?;
    Ok(answer.stamp.unwrap().step)
}

/// Returns the news of one ticket until its end.
fn news(world: &Embedded, ticket: Ticket) -> Vec<What> {
    let mut all = Vec::new();
    while !matches!(all.last(), Some(What::Ended)) {
        let notices = world.next_notices(SECOND).unwrap();
        assert!(!notices.is_empty(), "there is no end: {all:?}");
        all.extend(notices.into_iter().filter(|notice| notice.ticket == ticket).map(|notice| notice.what));
    }
    all
}

#[test]
fn a_call_is_answered_on_the_callers_thread() {
    let world = world(|_| ());
    assert_eq!(step(&world, 1).unwrap(), 1);
    assert_eq!(step(&world, 100).unwrap(), 101);
    assert_eq!(world.handle().newest().state.at.step, 101);
}

#[test]
fn a_refusal_has_its_reason_as_over_every_transport() {
    let world = world(|_| ());
    let refused = step(&world, 0).unwrap_err();
    let status = tonic_types::pb::Status::decode(world.refusal(&refused).as_slice()).unwrap();
    assert_eq!(status.code, tonic::Code::InvalidArgument as i32);
    assert_eq!(status.details.len(), refused_details(&refused));
    assert!(status.details.iter().any(|detail| detail.type_url.ends_with("google.rpc.ErrorInfo")));
    let unknown = world.call("SimulationService/Fly", Bytes::new(), SECOND, || true).unwrap_err();
    assert_eq!(unknown.code(), tonic::Code::Unimplemented);
}

fn refused_details(status: &Status) -> usize {
    tonic_types::pb::Status::decode(status.details()).unwrap().details.len()
}

#[test]
fn a_client_of_another_version_is_refused() {
    let world = Embedded::start(Config::default(), "99.0", "test").unwrap();
    assert_eq!(step(&world, 1).unwrap_err().code(), tonic::Code::FailedPrecondition);
}

#[test]
fn a_call_ends_with_its_time_limit_or_if_its_caller_does_not_continue() {
    let world = world(|_| ());
    let request = v1::NextJointStatesRequest {
        after_sequence: u64::MAX,
        timeout: 30.0,
        ..v1::NextJointStatesRequest::default()
    };
    let bytes = Bytes::from(request.encode_to_vec());
    let method = "JointService/NextJointStates";
    let late = world.call(method, bytes.clone(), Duration::from_millis(20), || true).unwrap_err();
    assert_eq!(late.code(), tonic::Code::DeadlineExceeded);
    let cut = world.call(method, bytes, SECOND, || false).unwrap_err();
    assert_eq!(cut.code(), tonic::Code::Cancelled);
}

#[test]
fn a_call_that_was_begun_gives_its_answer_and_ends() {
    let world = world(|_| ());
    let request = v1::GetSimulationStateRequest {}.encode_to_vec();
    let ticket = world.begin("SimulationService/GetSimulationState", request.into(), SECOND).unwrap();
    let news = news(&world, ticket);
    assert!(matches!(news.as_slice(), [What::Answer(_), What::Ended]), "{news:?}");
}

#[test]
fn a_stream_gives_notices_until_its_time_is_over() {
    let world = world(|_| ());
    let request = v1::WatchEventsRequest::default().encode_to_vec();
    let ticket = world.begin("EventService/WatchEvents", request.into(), Duration::from_millis(300)).unwrap();
    let news = news(&world, ticket);
    assert!(matches!(news.as_slice(), [.., What::Refused(_), What::Ended]), "{news:?}");
}

#[test]
fn events_that_are_subscribed_to_come_with_their_key() {
    let world = world(|_| ());
    let ticket = world.subscribe(Topic::parse("simd/simd/events").unwrap()).unwrap();
    // The task subscribes asynchronously: a change that it misses is followed by others.
    let mut notices = Vec::new();
    for state in [RunState::Playing, RunState::Paused].into_iter().cycle().take(1000) {
        world.runtime().unwrap().block_on(world.handle().set_state(state)).unwrap();
        notices = world.next_notices(Duration::from_millis(10)).unwrap();
        if !notices.is_empty() {
            break;
        }
    }
    let Some(Notice { ticket: of, what: What::Published { key, payload } }) = notices.first() else {
        panic!("nothing was published: {notices:?}");
    };
    assert_eq!((*of, key.as_str()), (ticket, "simd/simd/events"));
    assert!(v1::WatchEventsResponse::decode(payload.as_slice()).unwrap().event.is_some());
    world.end(ticket);
    assert!(world.lock().tasks.is_empty());
}

#[test]
fn only_so_much_is_under_way() {
    let world = world(|_| ());
    for _ in 0..UNDER_WAY {
        world.subscribe(Topic::Parameters).unwrap();
    }
    let refused = world.subscribe(Topic::Parameters).unwrap_err();
    assert_eq!(refused.code(), tonic::Code::ResourceExhausted);
}

#[test]
fn keys_of_what_is_not_published_have_no_topic() {
    assert_eq!(Topic::parse("simd/lab/joint_states/arm"), Some(Topic::JointStates("arm".into())));
    assert_eq!(
        Topic::parse("simd/lab/sensor_readings/*/imu"),
        Some(Topic::SensorReadings("*".into(), "imu".into()))
    );
    for key in ["", "simd", "simd/lab", "simd/lab/joint_states", "simd/lab/events/a", "other/lab/events"] {
        assert_eq!(Topic::parse(key), None, "{key}");
    }
}

#[test]
fn a_world_that_was_closed_refuses_and_gives_no_notices() {
    let world = world(|_| ());
    world.close();
    assert_eq!(step(&world, 1).unwrap_err().code(), tonic::Code::Unavailable);
    assert!(world.next_notices(SECOND).is_none());
}
