//! Markers, cameras and input, without a transport.

use std::sync::atomic::{AtomicU64, Ordering};

use tokio_util::sync::CancellationToken;

use super::super::Transport;
use super::super::testing::paused;
use super::*;
use crate::account::Account;
use crate::handle::CallContext;

const SECOND: Duration = Duration::from_secs(1);

fn lines(count: usize) -> NewMarker {
    let shape = MarkerShape::Lines { points: vec![0.0; 6 * count], colors: Vec::new(), width: 1.0 };
    let (robot, link) = Default::default();
    NewMarker { replaces: 0, shape, color: None, robot, link, life_time: None }
}

fn lasting(seconds: u64) -> NewMarker {
    NewMarker { life_time: Some(SECOND * u32::try_from(seconds).unwrap()), ..lines(1) }
}

fn ids(handle: &SimHandle) -> Vec<u64> {
    handle.markers().1.iter().map(|marker| marker.id).collect()
}

/// Returns a handle for a separate client, as limits know it.
fn another(handle: &SimHandle) -> SimHandle {
    static NUMBER: AtomicU64 = AtomicU64::new(0);
    handle.of_call(CallContext::of(Account::Connection(NUMBER.fetch_add(1, Ordering::Relaxed))))
}

fn page(name: &str) -> Caller {
    Caller::said(name, Transport::GrpcWeb).unwrap()
}

fn key(key: &str, is_down: bool) -> InputKind {
    InputKind::Key { key: key.into(), code: String::new(), is_down }
}

fn moved(x: f64) -> InputKind {
    InputKind::Mouse { at: [x, 0.0], button: None, is_down: false }
}

async fn change(handle: &SimHandle, version: u64) -> ViewChange {
    handle.next_view(version, Duration::from_millis(1), None).await.unwrap()
}

#[tokio::test(start_paused = true)]
async fn a_page_learns_what_was_added_replaced_and_deleted_since_it_asked() {
    let handle = paused();
    let first = change(&handle, 0).await;
    assert_eq!((first.version, first.whole, first.markers.len()), (1, true, 0));
    assert_eq!(handle.add_markers(vec![lines(1), lines(2)], None).unwrap(), [1, 2]);
    let added = change(&handle, first.version).await;
    assert_eq!((added.version, added.whole, added.markers.len()), (2, false, 2));

    let replacing = NewMarker { replaces: 1, ..lines(3) };
    assert_eq!(handle.add_markers(vec![replacing, lines(4)], None).unwrap(), [1, 3]);
    assert_eq!(handle.delete_markers(&[2, 9, 2]).unwrap(), [2], "once, and without what is not there");
    let seen = change(&handle, added.version).await;
    assert_eq!(seen.markers.iter().map(|marker| marker.id).collect::<Vec<_>>(), [1, 3]);
    assert_eq!((seen.version, seen.deleted), (4, vec![2]));
    // A deleted marker is not replaced: its id is never used again.
    assert_eq!(handle.add_markers(vec![NewMarker { replaces: 2, ..lines(1) }], None).unwrap(), [4]);
    assert_eq!(handle.delete_markers(&[]).unwrap(), [1, 3, 4]);
    let version = change(&handle, 0).await.version;
    assert_eq!(handle.delete_markers(&[]).unwrap(), [0; 0]);
    assert_eq!(change(&handle, version).await.version, version, "nothing has changed");
}

#[tokio::test(start_paused = true)]
async fn late_pages_and_pages_of_an_earlier_daemon_get_everything() {
    let handle = paused();
    handle.add_markers(vec![lines(1)], None).unwrap();
    assert!(change(&handle, 1_000).await.whole);
    for _ in 0..5_000 {
        let ids = handle.add_markers(vec![lines(1)], None).unwrap();
        handle.delete_markers(&ids).unwrap();
    }
    let late = change(&handle, 2).await;
    assert_eq!((late.whole, late.markers.len(), late.deleted.len()), (true, 1, 0));
    let version = late.version;
    assert!(!change(&handle, version - 100).await.whole);
}

#[tokio::test(start_paused = true)]
async fn a_marker_goes_when_its_time_is_over_and_those_that_wait_are_notified() {
    let handle = paused();
    handle.add_markers(vec![lasting(2), lines(1), lasting(5)], None).unwrap();
    let began = Instant::now();
    let version = change(&handle, 0).await.version;
    let gone = handle.next_view(version, 60 * SECOND, None).await.unwrap();
    assert_eq!((gone.deleted, began.elapsed().as_secs()), (vec![1], 2));
    let gone = handle.next_view(gone.version, 60 * SECOND, None).await.unwrap();
    assert_eq!((gone.deleted, began.elapsed().as_secs()), (vec![3], 5));
    // Replaced by a permanent one, it stays.
    let [id] = handle.add_markers(vec![lasting(1)], None).unwrap()[..] else { panic!("one") };
    handle.add_markers(vec![NewMarker { replaces: id, ..lines(1) }], None).unwrap();
    tokio::time::advance(60 * SECOND).await;
    assert_eq!(ids(&handle), [2, id]);
}

#[tokio::test(start_paused = true)]
async fn a_marker_goes_with_the_connection_that_it_was_made_for() {
    let handle = paused();
    let connection = CancellationToken::new();
    handle.add_markers(vec![lines(1)], Some(&connection)).unwrap();
    handle.add_markers(vec![lines(1)], None).unwrap();
    tokio::time::advance(60 * SECOND).await;
    assert_eq!(ids(&handle), [1, 2]);
    connection.cancel();
    tokio::time::advance(SECOND).await;
    assert_eq!(ids(&handle), [2]);
}

#[tokio::test]
async fn there_is_room_for_others_whatever_one_client_draws() {
    let handle = paused();
    let [one, other] = [another(&handle), another(&handle)];
    one.add_markers(vec![lines(1); 3_072], None).unwrap();
    let refused = one.add_markers(vec![lines(1)], None).unwrap_err().to_string();
    assert!(refused.contains("would be 3073, and the limit is 3072"), "{refused}");
    // Replacing a marker takes no additional room.
    one.add_markers(vec![NewMarker { replaces: 1, ..lines(2) }], None).unwrap();
    other.add_markers(vec![lines(1); 1_024], None).unwrap();
    let refused = another(&handle).add_markers(vec![lines(1)], None).unwrap_err().to_string();
    assert_eq!(refused, "the number of all markers would be 4097, and the limit is 4096");
    assert_eq!(ids(&handle).len(), 4_096);
    one.delete_markers(&[1]).unwrap();
    other.add_markers(vec![lines(1)], None).unwrap();
}

#[tokio::test]
async fn bytes_are_bounded_for_each_client_and_for_all() {
    let handle = paused();
    // Some 6 MB each.
    let large = || vec![lines(250_000)];
    let one = another(&handle);
    one.add_markers(large(), None).unwrap();
    one.add_markers(large(), None).unwrap();
    let refused = one.add_markers(large(), None).unwrap_err().to_string();
    assert!(refused.contains("the bytes of the markers by connection"), "{refused}");
    let refused = another(&handle).add_markers(large(), None).unwrap_err().to_string();
    assert!(refused.contains("the bytes of all markers"), "{refused}");
    one.delete_markers(&[1]).unwrap();
    another(&handle).add_markers(large(), None).unwrap();
}

#[tokio::test]
async fn a_marker_on_what_is_not_there_is_refused_and_none_is_added() {
    let handle = paused();
    let lost = NewMarker { robot: "lost".into(), ..lines(1) };
    let refused = handle.add_markers(vec![lines(1), lost], None).unwrap_err();
    assert!(refused.to_string().contains("lost"), "{refused}");
    assert!(ids(&handle).is_empty());
}

#[tokio::test]
async fn drawings_with_a_token_belong_to_its_owner() {
    let handle = paused();
    let [alice, bob] =
        ["alice", "bob"].map(|name| handle.of_call(CallContext::of(Account::Token(name.into()))));
    alice.add_markers(vec![lines(1)], None).unwrap();
    bob.add_markers(vec![lines(1)], None).unwrap();
    let refused = bob.delete_markers(&[2, 1]).unwrap_err().to_string();
    assert_eq!(refused, "marker 1 belongs to alice; choose another name, or take it over");
    assert!(bob.add_markers(vec![NewMarker { replaces: 1, ..lines(1) }], None).is_err());
    assert_eq!(ids(&handle), [1, 2]);
    assert_eq!(bob.delete_markers(&[]).unwrap(), [2]);
    assert_eq!(bob.taking_over(true).delete_markers(&[1]).unwrap(), [1]);
}

fn camera(x: f64) -> ViewCamera {
    use glamx::DVec3;
    let (position, target, up) = (DVec3::new(x, 0.0, 1.0), DVec3::ZERO, DVec3::Z);
    ViewCamera { position, target, up, field_of_view: 0.6, size: [800, 600] }
}

#[tokio::test(start_paused = true)]
async fn a_page_is_open_while_it_asks_and_the_one_that_moved_last_is_first() {
    let handle = paused();
    let [a, b] = ["viewer-a", "viewer-b"].map(page);
    handle.report_camera(&a, Some(camera(1.0)), 0);
    tokio::time::advance(SECOND).await;
    handle.report_camera(&b, Some(camera(2.0)), 0);
    let names = || handle.cameras().0.iter().map(|page| page.client.to_string()).collect::<Vec<_>>();
    assert_eq!(names(), ["viewer-b", "viewer-a"]);
    assert_eq!(handle.cameras().0[1].age, SECOND);
    for _ in 0..6 {
        tokio::time::advance(SECOND).await;
        handle.next_view(0, SECOND, Some(&a)).await.unwrap();
    }
    assert_eq!(names(), ["viewer-a"]);
    assert_eq!(handle.cameras().0[0].camera, camera(1.0));
}

#[tokio::test(start_paused = true)]
async fn a_camera_that_is_set_reaches_pages_once_and_they_say_that_they_followed() {
    let handle = paused();
    let version = change(&handle, 0).await.version;
    let (position, target) = (camera(3.0).position, camera(3.0).target);
    let set = handle.set_camera(position, target, 0.0);
    let seen = handle.next_view(version, 60 * SECOND, None).await.unwrap();
    assert_eq!(seen.camera, Some(CameraTarget { version: set, position, target, field_of_view: 0.0 }));
    assert_eq!(handle.set_camera(position, target, 0.0), set + 1);
    handle.report_camera(&page("viewer"), Some(camera(3.0)), set);
    handle.report_camera(&page("viewer"), None, set + 1);
    assert_eq!(handle.cameras().0[0].followed, set + 1);
}

#[tokio::test]
async fn endless_pages_take_no_endless_memory() {
    let handle = paused();
    for number in 0..1_000 {
        handle.report_camera(&page(&format!("viewer-{number}")), Some(camera(1.0)), 0);
    }
    assert_eq!(handle.cameras().0.len(), 64);
}

#[tokio::test(start_paused = true)]
async fn input_is_reported_from_when_a_program_asks_until_it_no_longer_does() {
    let (handle, viewer, script) = (paused(), page("viewer"), page("script"));
    assert!(!handle.report_input(&viewer, vec![key("a", true)]), "it is not asked for");
    let begin = handle.next_input(None, SECOND, Some(&script)).await.unwrap();
    assert!(begin.events.is_empty() && !begin.missed);
    assert_eq!(change(&handle, 0).await.asks.as_deref(), Some("script"));
    assert!(handle.report_input(&viewer, vec![key("a", true), moved(1.0), moved(2.0), key("a", false)]));
    let read = handle.next_input(Some(begin.sequence), SECOND, Some(&script)).await.unwrap();
    let kinds: Vec<InputKind> = read.events.iter().map(|event| event.kind.clone()).collect();
    assert_eq!(kinds, [key("a", true), moved(2.0), key("a", false)], "moves are one");
    assert!(read.events.iter().all(|event| &*event.client == "viewer") && !read.missed);
    // A program that begins now does not get earlier input.
    let late = handle.next_input(None, SECOND, None).await.unwrap();
    assert_eq!(late.sequence, read.sequence);
    tokio::time::advance(10 * SECOND).await;
    assert!(!handle.report_input(&viewer, vec![key("b", true)]));
    assert_eq!(change(&handle, 0).await.asks, None);
    let again = handle.next_input(Some(begin.sequence), SECOND, Some(&script)).await.unwrap();
    assert!(again.events.is_empty() && again.missed, "what was before is gone: {again:?}");
}

#[tokio::test(start_paused = true)]
async fn a_waiting_program_gets_input_when_it_arrives() {
    let (handle, viewer) = (paused(), page("viewer"));
    let begin = handle.next_input(None, SECOND, None).await.unwrap();
    let waiting = handle.next_input(Some(begin.sequence), 60 * SECOND, None);
    let report = async { handle.report_input(&viewer, vec![key("x", true)]) };
    let (read, reported) = tokio::join!(waiting, report);
    assert!(reported);
    assert_eq!(read.unwrap().events[0].kind, key("x", true));
    let nothing = handle.next_input(Some(1), SECOND, None).await.unwrap();
    assert_eq!((nothing.sequence, nothing.events.len()), (1, 0));
}

#[tokio::test]
async fn the_newest_of_too_many_events_are_kept_and_the_loss_is_reported() {
    let (handle, viewer) = (paused(), page("viewer"));
    let begin = handle.next_input(None, SECOND, None).await.unwrap();
    for _ in 0..20 {
        handle.report_input(&viewer, vec![key("a", true); 100]);
    }
    let read = handle.next_input(Some(begin.sequence), SECOND, None).await.unwrap();
    assert_eq!((read.events.len(), read.sequence, read.missed), (1_024, 2_000, true));
}
