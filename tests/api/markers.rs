//! Markers that programs draw in pages, the cameras of pages, and key and mouse input there.

use std::time::Duration;

use simd_client::access::Role;
use simd_client::proto::{
    self, ErrorReason, InputEvent, KeyInput, LinkColor, Marker, MouseButton, MouseInput, ReportViewRequest,
    Vector3, input_event, marker,
};
use simd_client::{Client, Error, lines, points, text};
use simd_tests::daemon::{Daemon, Via};
use simd_tests::process::soon;

use crate::security::{guarded, of, of_second};
use crate::{arm, load_arm};

const SECOND: Duration = Duration::from_secs(1);

fn at(x: f64) -> Vector3 {
    Vector3 { x, y: 0.0, z: 1.0 }
}

fn line() -> Marker {
    lines(&[[[0.0; 3], [1.0; 3]]], 2.0)
}

fn dot() -> Marker {
    points(&[[0.5, 0.0, 0.25]], 6.0)
}

async fn ids(client: &Client) -> Vec<u64> {
    client.markers().await.unwrap().iter().map(|marker| marker.id).collect()
}

async fn a_page_gets_the_markers_of_a_client_and_another_client_deletes_them(via: Via) {
    let daemon = arm(via).await;
    let page = daemon.another_client().await;
    let first = page.next_view(0, SECOND).await.unwrap();
    assert!(first.whole && first.markers.is_empty() && first.camera.is_none() && !first.wants_input);
    let words = Marker {
        robot: "arm".into(),
        color: Some(proto::Color { red: 1.0, green: 0.5, blue: 0.0, alpha: 1.0 }),
        life_time: 3600.0,
        ..text("tip", at(0.5), 0.2)
    };
    let waiting = page.next_view(first.version, SECOND * 60);
    let add = daemon.client.add_markers([line(), words.clone(), dot()], false);
    let (seen, added) = tokio::join!(waiting, add);
    let (seen, added) = (seen.unwrap(), added.unwrap());
    assert_eq!((added.as_slice(), seen.whole), ([1, 2, 3].as_slice(), false));
    // The remaining life time differs at each call.
    let lasting = |marker: &Marker| Marker { life_time: 0.0, ..marker.clone() };
    let all: Vec<_> = daemon.client.markers().await.unwrap().iter().map(lasting).collect();
    assert_eq!(seen.markers.iter().map(lasting).collect::<Vec<_>>(), all);
    let shown = &seen.markers[1];
    assert_eq!((&shown.shape, &shown.color, &shown.robot), (&words.shape, &words.color, &words.robot));
    assert!(shown.life_time > 3500.0 && shown.life_time <= 3600.0, "{}", shown.life_time);

    let other = daemon.another_client().await;
    assert_eq!(other.delete_markers(vec![1, 77]).await.unwrap(), [1]);
    let replacing = Marker { id: 3, ..line() };
    assert_eq!(other.add_markers([replacing], false).await.unwrap(), [3]);
    let changed = page.next_view(seen.version, SECOND).await.unwrap();
    assert_eq!(
        (changed.deleted.as_slice(), changed.markers.len(), changed.markers[0].id),
        ([1].as_slice(), 1, 3)
    );
    // Nothing is newer: after the timeout the view is the same.
    let same = page.next_view(changed.version, Duration::from_millis(5)).await.unwrap();
    assert_eq!((same.version, same.markers.len(), same.whole), (changed.version, 0, false));
    assert_eq!(other.delete_markers(Vec::new()).await.unwrap(), [2, 3]);
}

async fn resets_and_restores_leave_markers_alone(via: Via) {
    let daemon = arm(via).await;
    daemon.client.save_state("before").await.unwrap();
    daemon.client.add_markers([line(), Marker { robot: "arm".into(), ..line() }], false).await.unwrap();
    daemon.client.restore_state("before").await.unwrap();
    daemon.client.delete_robot("arm").await.unwrap();
    let all = proto::ResetSimulationRequest { time: true, state: true, spawned: true, ..Default::default() };
    daemon.client.reset(all).await.unwrap();
    assert_eq!(ids(&daemon.client).await, [1, 2]);
}

async fn links_are_given_colours_until_their_robot_is_reloaded_or_goes(via: Via) {
    let daemon = arm(via).await;
    let (client, page) = (&daemon.client, daemon.another_client().await);
    let first = page.next_view(0, SECOND).await.unwrap();
    assert_eq!(first.colors, None);
    let given = |link: &str, red: f64| LinkColor {
        robot: "arm".into(),
        link: link.into(),
        color: Some(proto::Color { red, green: 0.5, blue: 0.25, alpha: 1.0 }),
        layout_version: 0,
    };
    let shown = |colors: Option<proto::LinkColors>| -> Vec<(String, f64)> {
        let of = |each: LinkColor| (each.link, each.color.unwrap_or_default().red);
        colors.unwrap_or_default().colors.into_iter().map(of).collect()
    };
    let waiting = page.next_view(first.version, SECOND * 60);
    let set = client.set_link_colors([given("arm", 1.0), given("base_link", 0.0), given("arm", 0.75)]);
    let (seen, ()) = tokio::try_join!(waiting, set).unwrap();
    let versions: Vec<u64> =
        seen.colors.iter().flat_map(|all| &all.colors).map(|each| each.layout_version).collect();
    assert!(versions.len() == 2 && versions[0] > 0 && versions[0] == versions[1], "{versions:?}");
    assert_eq!(shown(seen.colors), [("arm".to_owned(), 0.75), ("base_link".to_owned(), 0.0)]);
    // Another change of the view does not send them again, and a page that comes later gets them.
    client.add_markers([line()], false).await.unwrap();
    let other = page.next_view(seen.version, SECOND).await.unwrap();
    assert_eq!(other.colors, None);
    assert_eq!(shown(page.next_view(0, SECOND).await.unwrap().colors).len(), 2);
    client.set_link_colors([LinkColor { color: None, ..given("base_link", 0.0) }]).await.unwrap();
    let without = page.next_view(other.version, SECOND).await.unwrap();
    assert_eq!(shown(without.colors), [("arm".to_owned(), 0.75)]);
    // A missing marker is refused, with the whole request.
    for (refused, reason) in [
        (LinkColor { robot: "moon".into(), ..given("arm", 0.0) }, ErrorReason::RobotNotFound),
        (given("wing", 0.0), ErrorReason::LinkNotFound),
        (given("arm", 1.5), ErrorReason::InvalidValue),
    ] {
        let error: Error = client.set_link_colors([given("base_link", 0.0), refused]).await.unwrap_err();
        assert_eq!(error.reason(), Some(reason), "{error}");
    }
    let same = page.next_view(without.version, Duration::from_millis(5)).await.unwrap();
    assert_eq!(same.version, without.version);
    // The markers of a removed robot go with the next change.
    client.delete_robot("arm").await.unwrap();
    load_arm(client, "arm").await;
    client.set_link_colors([given("base_link", 0.5)]).await.unwrap();
    let anew = page.next_view(without.version, SECOND).await.unwrap();
    assert_eq!(shown(anew.colors), [("base_link".to_owned(), 0.5)]);
}

async fn an_invalid_marker_is_refused_with_all_others_of_its_call(via: Via) {
    let daemon = arm(via).await;
    let client = &daemon.client;
    let on = |robot: &str, link: &str| Marker { robot: robot.into(), link: link.into(), ..line() };
    for (marker, reason) in [
        (on("moon", ""), ErrorReason::RobotNotFound),
        (on("arm", "wing"), ErrorReason::LinkNotFound),
        (Marker::default(), ErrorReason::InvalidValue),
        (lines(&[[[f32::NAN; 3]; 2]], 1.0), ErrorReason::InvalidValue),
        (lines(&[[[0.0; 3]; 2]], -1.0), ErrorReason::InvalidValue),
        (points(&[], 1.0), ErrorReason::InvalidValue),
        (text("", at(0.0), 0.1), ErrorReason::InvalidValue),
        (text("two\nlines", at(0.0), 0.1), ErrorReason::InvalidValue),
        (text("here", at(f64::INFINITY), 0.1), ErrorReason::InvalidValue),
        (Marker { life_time: f64::NAN, ..line() }, ErrorReason::InvalidValue),
    ] {
        let refused = client.add_markers([line(), marker.clone()], false).await.unwrap_err();
        assert_eq!(refused.reason(), Some(reason), "{marker:?}");
    }
    assert!(client.add_markers([], false).await.is_err());
    assert!(ids(client).await.is_empty());
}

async fn there_are_never_more_than_the_limit_and_one_sentence_says_so(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let many = |count: usize| vec![line(); count];
    let room = loop {
        match daemon.client.add_markers(many(512), false).await {
            Ok(_) => {}
            Err(error) => break error,
        }
    };
    assert_eq!(room.reason(), Some(ErrorReason::LimitExceeded), "{room}");
    assert!(room.to_string().contains("the number of "), "{room}");
    assert!(ids(&daemon.client).await.len() <= 4096);
    assert!(daemon.client.add_markers(many(5000), false).await.is_err());
    daemon.client.delete_markers(Vec::new()).await.unwrap();
    daemon.client.add_markers([line()], false).await.unwrap();
}

fn camera(x: f64) -> proto::ViewCamera {
    proto::ViewCamera {
        position: Some(at(x)),
        target: Some(at(0.0)),
        up: Some(Vector3 { x: 0.0, y: 0.0, z: 1.0 }),
        field_of_view: 0.6,
        width: 800,
        height: 600,
    }
}

async fn cameras_are_reported_and_moved(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let page = daemon.another_client().await.with_name("viewer-0001");
    assert!(daemon.client.cameras().await.unwrap().cameras.is_empty());
    let report = ReportViewRequest { camera: Some(camera(1.0)), ..Default::default() };
    assert!(!page.report_view(report).await.unwrap().wants_input);
    let seen = daemon.client.cameras().await.unwrap().cameras;
    assert_eq!((seen[0].client.as_str(), &seen[0].camera), ("viewer-0001", &Some(camera(1.0))));

    let version = page.next_view(0, SECOND).await.unwrap().version;
    let waiting = page.next_view(version, SECOND * 60);
    let set = daemon.client.set_camera(at(3.0), at(0.5), Some(1.0));
    let (moved, set) = tokio::join!(waiting, set);
    let target = moved.unwrap().camera.unwrap();
    assert_eq!(
        (target.version, target.position, target.target),
        (set.unwrap(), Some(at(3.0)), Some(at(0.5)))
    );
    assert_eq!(target.field_of_view, 1.0);
    let followed = ReportViewRequest { followed_version: target.version, ..Default::default() };
    page.report_view(followed).await.unwrap();
    let seen = daemon.client.cameras().await.unwrap();
    assert_eq!((seen.cameras[0].followed_version, seen.camera), (target.version, Some(target)));

    for (position, target) in [(at(1.0), at(1.0)), (at(f64::NAN), at(1.0))] {
        let refused = daemon.client.set_camera(position, target, None).await.unwrap_err();
        assert_eq!(refused.reason(), Some(ErrorReason::InvalidValue));
    }
    let wrong = proto::ViewCamera { width: 0, ..camera(1.0) };
    let report = ReportViewRequest { camera: Some(wrong), ..Default::default() };
    assert_eq!(page.report_view(report).await.unwrap_err().reason(), Some(ErrorReason::InvalidValue));
}

fn key(is_down: bool) -> InputEvent {
    let key = KeyInput { key: "a".into(), code: "KeyA".into(), is_down };
    InputEvent { kind: Some(input_event::Kind::Key(key)), ..Default::default() }
}

fn click() -> InputEvent {
    let mouse = MouseInput { x: 3.0, y: 4.0, button: MouseButton::Right.into(), is_down: true };
    InputEvent { kind: Some(input_event::Kind::Mouse(mouse)), ..Default::default() }
}

async fn keys_and_mouse_go_to_the_program_that_asks(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let page = daemon.another_client().await.with_name("viewer-0001");
    let script = daemon.another_client().await.with_name("script");
    let report = || ReportViewRequest { input: vec![key(true), click(), key(false)], ..Default::default() };
    assert!(!page.report_view(report()).await.unwrap().wants_input, "no program asks");
    let begin = script.next_input(None, SECOND).await.unwrap();
    assert!(begin.events.is_empty());
    let view = page.next_view(0, SECOND).await.unwrap();
    assert_eq!((view.wants_input, view.input_client.as_str()), (true, "script"));
    let waiting = script.next_input(Some(begin.sequence), SECOND * 60);
    let (read, reported) = tokio::join!(waiting, page.report_view(report()));
    assert!(reported.unwrap().wants_input);
    let read = read.unwrap();
    let kinds: Vec<_> = read.events.iter().map(|event| event.kind.clone()).collect();
    assert_eq!(kinds, [key(true), click(), key(false)].map(|event| event.kind));
    assert!(read.events.iter().all(|event| event.client == "viewer-0001") && !read.missed);
    let none = script.next_input(Some(read.sequence), Duration::from_millis(1)).await.unwrap();
    assert_eq!((none.sequence, none.events.len()), (read.sequence, 0));
    let many = ReportViewRequest { input: vec![key(true); 257], ..Default::default() };
    assert_eq!(page.report_view(many).await.unwrap_err().reason(), Some(ErrorReason::InvalidValue));
}

/// Over gRPC the connection, and over Zenoh the session if its client has declared a token.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn markers_that_are_bound_to_a_connection_go_with_it() {
    for via in [Via::Grpc, Via::Zenoh] {
        let daemon = Daemon::paused_via(via).await;
        let other = daemon.another_client().await;
        other.add_markers([line()], true).await.unwrap();
        other.add_markers([line()], false).await.unwrap();
        assert_eq!(ids(&daemon.client).await, [1, 2], "{via:?}");
        let version = daemon.client.next_view(0, SECOND).await.unwrap().version;
        drop(other);
        soon("the marker goes", async {
            let gone = daemon.client.next_view(version, SECOND * 60).await.unwrap();
            assert_eq!(gone.deleted, [1]);
        })
        .await;
        assert_eq!(ids(&daemon.client).await, [2]);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn drawings_with_a_token_are_deleted_by_its_owner_or_an_admin() {
    let guarded = guarded(|_, _| {}).await;
    let [operator, admin, second] = [
        guarded.client(&of(Role::Operator)).await,
        guarded.client(&of(Role::Admin)).await,
        guarded.client(&of_second()).await,
    ];
    operator.add_markers([line()], false).await.unwrap();
    admin.add_markers([line()], false).await.unwrap();
    let owners: Vec<String> =
        second.markers().await.unwrap().into_iter().map(|marker| marker.owner).collect();
    assert_eq!(owners, ["operator", "admin"]);
    for refused in [
        second.delete_markers(vec![1]).await.map(drop),
        second.add_markers([Marker { id: 1, ..line() }], false).await.map(drop),
    ] {
        let error: Error = refused.unwrap_err();
        assert_eq!(error.reason(), Some(ErrorReason::OwnedByAnother), "{error}");
    }
    // An operator may not take over.
    let refused = operator.clone().taking_over().delete_markers(vec![2]).await.unwrap_err();
    assert_eq!(refused.reason(), Some(ErrorReason::RoleTooLow));
    assert_eq!(second.taking_over().delete_markers(vec![1, 2]).await.unwrap(), [1, 2]);
}

/// Checks the geometry that the suite draws against independent lists.
#[test]
fn markers_are_made_of_flat_lists() {
    let made = lines(&[[[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]], [[6.0; 3], [7.0; 3]]], 1.5);
    let Some(marker::Shape::Lines(lines)) = made.shape else { panic!("lines") };
    assert_eq!(lines.points, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 6.0, 6.0, 7.0, 7.0, 7.0]);
    assert_eq!((lines.width, lines.colors.len()), (1.5, 0));
}

crate::over_every_transport![
    a_page_gets_the_markers_of_a_client_and_another_client_deletes_them,
    resets_and_restores_leave_markers_alone,
    links_are_given_colours_until_their_robot_is_reloaded_or_goes,
    an_invalid_marker_is_refused_with_all_others_of_its_call,
    there_are_never_more_than_the_limit_and_one_sentence_says_so,
    cameras_are_reported_and_moved,
    keys_and_mouse_go_to_the_program_that_asks,
];
