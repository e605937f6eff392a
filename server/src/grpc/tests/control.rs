//! Guarantees of `Control`.

use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::Streaming;

use super::*;

/// One controller.
struct Controller {
    requests: mpsc::Sender<v1::ControlRequest>,
    answers: Streaming<v1::ControlResponse>,
}

impl Controller {
    async fn connect(daemon: &Daemon) -> Self {
        let (requests, receiver) = mpsc::channel(16);
        let answers = daemon.joints().control(ReceiverStream::new(receiver)).await.unwrap().into_inner();
        Self { requests, answers }
    }

    async fn send(&self, request: v1::ControlRequest) {
        self.requests.send(request).await.unwrap();
    }

    async fn receive(&mut self) -> v1::ControlResponse {
        self.answers.message().await.unwrap().unwrap()
    }

    async fn ask(&mut self, request: v1::ControlRequest) -> v1::ControlResponse {
        self.send(request).await;
        self.receive().await
    }
}

fn credit() -> v1::ControlRequest {
    v1::ControlRequest { selections: vec![shoulder()], ..Default::default() }
}

fn at_once() -> v1::ControlRequest {
    v1::ControlRequest { wait: v1::ControlWait::None.into(), ..credit() }
}

fn with_target(position: f64) -> v1::ControlRequest {
    v1::ControlRequest { robots: move_shoulder("arm", position), ..credit() }
}

fn target(states: &v1::JointStates) -> f64 {
    states.robots[0].target[0]
}

#[tokio::test]
async fn an_answer_shows_the_targets_of_its_request_while_the_world_is_paused() {
    let daemon = Daemon::start(RunState::Paused).await;
    let mut controller = Controller::connect(&daemon).await;
    for position in [0.25, 0.5] {
        let answer = controller.ask(with_target(position)).await;
        assert_eq!(answer.refusal, None);
        assert_eq!(target(&answer.states.unwrap()), position);
    }
}

#[tokio::test]
async fn an_answer_shows_the_targets_of_its_request_while_the_world_is_playing() {
    let daemon = Daemon::start(RunState::Playing).await;
    let mut controller = Controller::connect(&daemon).await;
    let mut last = 0;
    for turn in 0..20 {
        let position = f64::from(turn) / 32.0;
        let states = controller.ask(with_target(position)).await.states.unwrap();
        assert_eq!(target(&states), position);
        assert!(sequence(&states) > last, "each answer is newer than the one before");
        last = sequence(&states);
    }
}

#[tokio::test]
async fn each_request_gets_one_answer_in_order() {
    let daemon = Daemon::start(RunState::Playing).await;
    let mut controller = Controller::connect(&daemon).await;
    for _ in 0..10 {
        controller.send(credit()).await;
    }
    let mut last = 0;
    for _ in 0..10 {
        let states = controller.receive().await.states.unwrap();
        assert!(sequence(&states) > last);
        last = sequence(&states);
    }
    drop(controller.requests);
    assert!(controller.answers.message().await.unwrap().is_none(), "the stream ends with its requests");
}

#[tokio::test]
async fn a_reader_that_stalls_is_at_most_one_state_behind() {
    let daemon = Daemon::start(RunState::Paused).await;
    let mut controller = Controller::connect(&daemon).await;
    let first = controller.ask(credit()).await.states.unwrap();
    // Its credit is answered with the first of these steps; then it does not read.
    controller.send(credit()).await;
    daemon.handle.step(1000).await.unwrap();
    let stalled = controller.receive().await.states.unwrap();
    assert!(sequence(&stalled) > sequence(&first));
    daemon.handle.step(1).await.unwrap();
    let newest = controller.ask(credit()).await.states.unwrap();
    assert_eq!(sequence(&newest), daemon.handle.newest().sequence);
}

#[tokio::test]
async fn a_paused_world_answers_with_the_state_there_is_after_the_timeout() {
    let daemon = Daemon::start(RunState::Paused).await;
    let mut controller = Controller::connect(&daemon).await;
    let first = controller.ask(credit()).await.states.unwrap();
    let again = controller.ask(v1::ControlRequest { timeout: 1e-3, ..credit() }).await.states.unwrap();
    assert_eq!(sequence(&first), sequence(&again));
}

#[tokio::test]
async fn a_client_that_does_not_wait_gets_the_present_state() {
    let daemon = Daemon::start(RunState::Paused).await;
    let mut controller = Controller::connect(&daemon).await;
    let first = controller.ask(at_once()).await.states.unwrap();
    let again = controller.ask(at_once()).await.states.unwrap();
    assert_eq!(sequence(&first), sequence(&again));
}

#[tokio::test]
async fn a_refusal_says_why_at_once_and_the_stream_continues() {
    let daemon = Daemon::start(RunState::Paused).await;
    let mut controller = Controller::connect(&daemon).await;
    assert_eq!(target(&controller.ask(with_target(0.5)).await.states.unwrap()), 0.5);

    let refused = controller.ask(with_target(f64::NAN)).await;
    let refusal = refused.refusal.unwrap();
    assert_eq!(refusal.reason(), v1::ErrorReason::InvalidValue);
    assert!(refusal.message.starts_with("robots[0].joints[0].position.position (joint \"shoulder\") is NaN"));
    assert_eq!(target(&refused.states.unwrap()), 0.5, "the world is unchanged");

    let missing = v1::ControlRequest { robots: move_shoulder("missing", 0.0), ..credit() };
    let refusal = controller.ask(missing).await.refusal.unwrap();
    assert_eq!(refusal.reason(), v1::ErrorReason::RobotNotFound);
    assert_eq!(refusal.metadata["robot"], "missing");

    let beyond = v1::ControlRequest { limit_policy: v1::LimitPolicy::Refuse.into(), ..with_target(5.0) };
    let refusal = controller.ask(beyond).await.refusal.unwrap();
    assert_eq!(refusal.reason(), v1::ErrorReason::TargetBeyondLimit);

    assert_eq!(target(&controller.ask(with_target(-0.5)).await.states.unwrap()), -0.5);
}

#[tokio::test]
async fn a_target_beyond_a_limit_is_clamped_and_the_answer_says_so() {
    let daemon = Daemon::start(RunState::Paused).await;
    let mut controller = Controller::connect(&daemon).await;
    let answer = controller.ask(with_target(5.0)).await;
    assert_eq!((answer.clamped[0].requested, answer.clamped[0].applied), (5.0, 1.0));
}

#[tokio::test]
async fn a_selection_is_kept_until_another_one_comes() {
    let daemon = Daemon::start(RunState::Playing).await;
    let mut controller = Controller::connect(&daemon).await;
    let all = controller.ask(v1::ControlRequest::default()).await.states.unwrap();
    assert_eq!(all.robots[0].position.len(), 5);
    controller.ask(credit()).await;
    let kept = controller.ask(v1::ControlRequest::default()).await.states.unwrap();
    assert_eq!(kept.robots[0].position.len(), 1);
}

#[tokio::test]
async fn targets_of_a_request_whose_selection_is_not_there_do_not_hold() {
    let daemon = Daemon::start(RunState::Paused).await;
    let mut controller = Controller::connect(&daemon).await;
    controller.ask(with_target(0.5)).await;
    let elbow = v1::JointSelection { robot: "arm".into(), joints: vec!["elbow".into()] };
    let refused = controller.ask(v1::ControlRequest { selections: vec![elbow], ..with_target(0.25) }).await;
    assert_eq!(refused.refusal.unwrap().reason(), v1::ErrorReason::JointNotFound);
    assert_eq!(refused.states, None);
    assert_eq!(target(&controller.ask(at_once()).await.states.unwrap()), 0.5);
}

#[tokio::test]
async fn a_selection_is_kept_where_the_rest_of_its_request_is_refused() {
    let daemon = Daemon::start(RunState::Paused).await;
    for bad in [with_target(f64::NAN), v1::ControlRequest { timeout: -1.0, ..credit() }] {
        let mut controller = Controller::connect(&daemon).await;
        let refused = controller.ask(bad).await;
        assert_eq!(refused.refusal.unwrap().reason(), v1::ErrorReason::InvalidValue);
        assert_eq!(refused.states.unwrap().robots[0].position.len(), 1);
        let request = v1::ControlRequest { selections: Vec::new(), ..at_once() };
        let kept = controller.ask(request).await.states.unwrap();
        assert_eq!(kept.robots[0].position.len(), 1);
    }
}

#[tokio::test]
async fn a_selection_of_a_robot_that_is_not_there_yet_is_refused_until_it_is() {
    let daemon = Daemon::start(RunState::Paused).await;
    let mut controller = Controller::connect(&daemon).await;
    let late = v1::JointSelection { robot: "late".into(), joints: Vec::new() };
    let mut request = v1::ControlRequest { selections: vec![late], ..Default::default() };
    for _ in 0..2 {
        let refused = controller.ask(std::mem::take(&mut request)).await;
        assert_eq!(refused.refusal.unwrap().reason(), v1::ErrorReason::RobotNotFound);
        assert_eq!(refused.states, None);
    }
    daemon.handle.command(spawn("late", &[])).await.unwrap();
    let states = controller.ask(v1::ControlRequest::default()).await.states.unwrap();
    assert_eq!(states.robots.iter().map(|robot| robot.robot.as_str()).collect::<Vec<_>>(), ["late"]);
}

#[tokio::test]
async fn a_robot_that_goes_away_is_a_refusal_without_a_state() {
    let daemon = Daemon::start(RunState::Paused).await;
    let mut controller = Controller::connect(&daemon).await;
    controller.ask(credit()).await;
    controller.send(credit()).await;
    daemon.handle.command(simd_core::Command::Delete { robot: "arm".into() }).await.unwrap();
    let answer = controller.receive().await;
    assert_eq!(answer.refusal.unwrap().reason(), v1::ErrorReason::RobotNotFound);
    assert_eq!(answer.states, None);
}
