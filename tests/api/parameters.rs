//! Sliders and buttons, as several programs share them.

use std::time::Duration;

use simd_client::proto::parameter::Kind;
use simd_client::proto::{self, ErrorReason, JointBinding, JointMode, NameTakenPolicy, Slider};
use simd_client::{Client, Error, Target, every_joint, press, slide};
use simd_tests::daemon::{Daemon, Via};

use crate::{arm, load_arm, set, shoulder};

const SECOND: Duration = Duration::from_secs(1);

async fn speed(client: &Client) -> f64 {
    let list = client.parameters(vec!["speed".into()]).await.unwrap();
    match list.parameters[0].kind.as_ref().unwrap() {
        Kind::Slider(slider) => slider.value,
        Kind::Button(button) => panic!("{button:?}"),
    }
}

/// Returns a paused daemon with a slider `speed` from -1 to 1 at 0.5 and a button `go`.
async fn daemon(via: Via) -> Daemon {
    let daemon = Daemon::paused_via(via).await;
    let refuse = NameTakenPolicy::Refuse;
    let slider = daemon.client.add_slider("speed", (-1.0, 1.0), 0.5, refuse).await.unwrap();
    assert_eq!(slider.kind, Some(Kind::Slider(Slider { minimum: -1.0, maximum: 1.0, value: 0.5 })));
    daemon.client.add_button("go", refuse).await.unwrap();
    daemon
}

async fn another_client_reads_a_moved_slider_and_a_third_is_notified(via: Via) {
    let daemon = daemon(via).await;
    let other = daemon.another_client().await;
    let mut watch = other.watch_parameters().await.unwrap();
    let first = watch.next().await.unwrap().unwrap();
    assert_eq!(first.parameters.iter().map(|it| it.name.as_str()).collect::<Vec<_>>(), ["speed", "go"]);

    let waiting = other.next_parameters(first.version, SECOND * 60);
    let set = async { daemon.client.set_parameters([slide("speed", -0.25), press("go", 2)]).await };
    let (seen_first, set) = tokio::join!(waiting, set);
    let (seen_first, set) = (seen_first.unwrap(), set.unwrap());
    assert_eq!(seen_first.parameters, set);
    assert_eq!(speed(&other).await, -0.25);
    let seen = watch.next().await.unwrap().unwrap();
    assert_eq!((seen.version, &seen.parameters), (seen_first.version, &set));

    assert_eq!(other.remove_parameters(vec!["speed".into()]).await.unwrap(), ["speed"]);
    assert_eq!(watch.next().await.unwrap().unwrap().parameters.len(), 1);
}

/// A thousand moves that are not read are not a thousand lists.
async fn late_clients_get_only_the_newest_values(via: Via) {
    let daemon = daemon(via).await;
    let before = daemon.client.parameters(Vec::new()).await.unwrap().version;
    for step in 1..=100 {
        daemon.client.set_parameters([slide("speed", f64::from(step) / 100.0)]).await.unwrap();
    }
    let list = daemon.client.next_parameters(before, SECOND).await.unwrap();
    assert_eq!(list.version, before + 100);
    assert_eq!(speed(&daemon.client).await, 1.0);
    // Nothing is newer: after the timeout the list is the same.
    let same = daemon.client.next_parameters(list.version, Duration::from_millis(20)).await.unwrap();
    assert_eq!(same.version, list.version);
}

async fn a_reset_of_the_world_leaves_the_sliders_where_they_are(via: Via) {
    let daemon = daemon(via).await;
    daemon.client.save_state("before").await.unwrap();
    daemon.client.set_parameters([slide("speed", 0.75)]).await.unwrap();
    daemon.client.restore_state("before").await.unwrap();
    let all = proto::ResetSimulationRequest { time: true, state: true, spawned: true, ..Default::default() };
    daemon.client.reset(all).await.unwrap();
    assert_eq!(speed(&daemon.client).await, 0.75);
}

async fn refusals_say_which_parameter_and_change_nothing(via: Via) {
    let daemon = daemon(via).await;
    let client = &daemon.client;
    let before = client.parameters(Vec::new()).await.unwrap();
    let taken = client.add_button("speed", NameTakenPolicy::Refuse).await.unwrap_err();
    assert_eq!(taken.reason(), Some(ErrorReason::ParameterExists));
    let unknown = client.set_parameters([slide("speed", 0.1), slide("sped", 0.1)]).await.unwrap_err();
    assert_eq!(unknown.reason(), Some(ErrorReason::ParameterNotFound));
    assert_eq!(unknown.to_string(), "there is no parameter \"sped\"; parameters are \"speed\", \"go\"");
    for (changes, field) in [
        (vec![slide("speed", f64::NAN)], "changes[0].value"),
        (vec![slide("speed", 0.1), slide("speed", 0.2)], "changes[1]"),
        (vec![press("go", 0)], "changes[0].presses"),
        (vec![slide("", 0.0)], "changes[0].name"),
        (Vec::new(), "changes"),
        (vec![slide("speed", 1.5)], "changes[0].value"),
    ] {
        let simd_client::Error::Refused(refusal) = client.set_parameters(changes).await.unwrap_err() else {
            panic!("{field}");
        };
        assert_eq!((refusal.reason, refusal.fields[0].0.as_str()), (ErrorReason::InvalidValue, field));
    }
    for range in [(0.0, f64::INFINITY), (1.0, 1.0), (2.0, 1.0)] {
        let refused = client.add_slider("other", range, 0.0, NameTakenPolicy::Refuse).await.unwrap_err();
        assert_eq!(refused.reason(), Some(ErrorReason::InvalidValue), "{range:?}");
    }
    assert_eq!(client.parameters(Vec::new()).await.unwrap().parameters, before.parameters);
}

async fn a_watch_of_parameters_ends_with_ok_when_the_daemon_drains(via: Via) {
    let daemon = daemon(via).await;
    let mut watch = daemon.client.watch_parameters().await.unwrap();
    watch.next().await.unwrap().unwrap();
    let drained = tokio::spawn(daemon.running.drain());
    assert!(watch.next().await.unwrap().is_none());
    drained.await.unwrap();
}

fn shoulder_of(robot: &str, mode: JointMode) -> JointBinding {
    JointBinding { robot: robot.into(), joint: "shoulder".into(), mode: mode.into(), ..Default::default() }
}

/// Returns a slider `lift` from -0.5 to 1, of the arm's shoulder.
async fn bound(client: &Client, mode: JointMode) -> Result<proto::Parameter, Error> {
    let joint = shoulder_of("arm", mode);
    client.add_bound_slider("lift", (-0.5, 1.0), 0.25, joint, NameTakenPolicy::Replace).await
}

async fn a_bound_slider_sets_the_target_for_each_client_that_moves_it(via: Via) {
    let daemon = arm(via).await;
    let before = shoulder(&daemon).await;
    let added = bound(&daemon.client, JointMode::Unspecified).await.unwrap();
    assert_eq!(added.joint, Some(shoulder_of("arm", JointMode::Position)));
    assert_eq!(shoulder(&daemon).await, before, "to put it up moves nothing");
    let other = daemon.another_client().await;
    other.set_parameters([slide("lift", 0.5)]).await.unwrap();
    let moved = shoulder(&daemon).await;
    assert_eq!((moved.mode, moved.target), (JointMode::Position, 0.5));
    for (mode, value) in [(JointMode::Velocity, -0.25), (JointMode::Effort, 0.75)] {
        bound(&daemon.client, mode).await.unwrap();
        other.set_parameters([slide("lift", value)]).await.unwrap();
        let moved = shoulder(&daemon).await;
        assert_eq!((moved.mode, moved.target), (mode, value));
    }
    // The slider's present position is a target too: another one may have been set since.
    set(&daemon, Target::Hold).await;
    other.set_parameters([slide("lift", 0.75)]).await.unwrap();
    assert_eq!(shoulder(&daemon).await.target, 0.75);
}

async fn a_target_that_is_refused_leaves_all_sliders_where_they_are(via: Via) {
    let daemon = arm(via).await;
    let client = &daemon.client;
    bound(client, JointMode::Position).await.unwrap();
    client.add_slider("speed", (-1.0, 1.0), 0.5, NameTakenPolicy::Refuse).await.unwrap();
    let before = client.parameters(Vec::new()).await.unwrap();
    let (target, both) = (shoulder(&daemon).await.target, [slide("speed", 1.0), slide("lift", 0.5)]);
    // A change that cannot be moves no robot.
    let beyond = [slide("lift", 0.5), slide("speed", 2.0)];
    assert_eq!(client.set_parameters(beyond).await.unwrap_err().reason(), Some(ErrorReason::InvalidValue));
    assert_eq!(shoulder(&daemon).await.target, target);
    // Claims of others are respected, and their claim moves the slider.
    let selections = vec![every_joint("arm")];
    let claim =
        proto::ClaimJointsRequest { selections, holder: "planner".into(), lease: 60.0, ..Default::default() };
    let secret = client.claim(claim).await.unwrap();
    let refused = client.set_parameters(both.clone()).await.unwrap_err();
    assert_eq!(refused.reason(), Some(ErrorReason::JointClaimed));
    assert_eq!(client.parameters(Vec::new()).await.unwrap().parameters, before.parameters);
    client.clone().with_claim(&secret).set_parameters(both.clone()).await.unwrap();
    assert_eq!(shoulder(&daemon).await.target, 0.5);
    client.release_joints(&secret).await.unwrap();
    // By name: without the robot it is refused, and with another of that name it works again.
    client.delete_robot("arm").await.unwrap();
    let gone = client.set_parameters(both.clone()).await.unwrap_err();
    assert_eq!(gone.reason(), Some(ErrorReason::RobotNotFound));
    load_arm(client, "arm").await;
    client.set_parameters(both).await.unwrap();
    assert_eq!(shoulder(&daemon).await.target, 0.5);
}

async fn impossible_bindings_are_refused(via: Via) {
    let daemon = arm(via).await;
    let client = &daemon.client;
    let shoulder = shoulder_of("arm", JointMode::Position);
    for (joint, reason) in [
        (shoulder_of("moon", JointMode::Position), ErrorReason::RobotNotFound),
        (JointBinding { joint: "knee".into(), ..shoulder.clone() }, ErrorReason::JointNotFound),
        (JointBinding { axis: 1, ..shoulder.clone() }, ErrorReason::InvalidValue),
        (shoulder_of("arm", JointMode::Hold), ErrorReason::InvalidValue),
        (JointBinding::default(), ErrorReason::InvalidValue),
    ] {
        let refused = client.add_bound_slider("lift", (0.0, 1.0), 0.5, joint, NameTakenPolicy::Refuse).await;
        assert_eq!(refused.unwrap_err().reason(), Some(reason));
    }
    assert!(client.parameters(Vec::new()).await.unwrap().parameters.is_empty());
}

crate::over_every_transport![
    a_bound_slider_sets_the_target_for_each_client_that_moves_it,
    a_target_that_is_refused_leaves_all_sliders_where_they_are,
    impossible_bindings_are_refused,
    another_client_reads_a_moved_slider_and_a_third_is_notified,
    late_clients_get_only_the_newest_values,
    a_reset_of_the_world_leaves_the_sliders_where_they_are,
    refusals_say_which_parameter_and_change_nothing,
    a_watch_of_parameters_ends_with_ok_when_the_daemon_drains,
];
