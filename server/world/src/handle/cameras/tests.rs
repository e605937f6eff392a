//! The queue of pictures, with given times.

use bytes::Bytes;
use tokio_util::sync::CancellationToken;

use super::super::testing::paused;
use super::*;

const SECOND: Duration = Duration::from_secs(1);
/// Bytes of a picture of 8 x 8 pixels in colour.
const BYTES: u64 = 8 * 8 * 3;

fn bounds() -> Bounds {
    Bounds { waiting: 4, bytes: 3 * BYTES, drawing: SECOND }
}

fn order(state: &Arc<Published>, camera: Option<u64>) -> PictureOrder {
    let mut projection = [0.0; 16];
    for (index, number) in [(0, 1.0), (5, 1.0), (10, -1.5), (11, -1.0), (14, -2.5)] {
        projection[index] = number;
    }
    let view = std::array::from_fn(|index| if index % 5 == 0 { 1.0 } else { 0.0 });
    PictureOrder {
        camera: camera.map(|id| (id, CameraName { robot: "arm".into(), sensor: id.to_string() })),
        view: PictureView {
            width: 8,
            height: 8,
            lens: Lens::of_matrices(view, projection).unwrap(),
            planes: Planes { color: true, ..Planes::default() },
            light: Light::default(),
            background: WHITE,
        },
        state: Arc::clone(state),
    }
}

fn drawn() -> Drawn {
    let data = Bytes::from(vec![0; BYTES as usize]);
    Drawn { color: Some(Plane { is_zlib: false, data }), ..Drawn::default() }
}

/// Returns a state, and a queue with an active renderer.
async fn begun() -> (Arc<Published>, PictureQueue, Arc<str>, Instant) {
    let handle = paused();
    let (state, now) = (handle.newest(), Instant::now());
    let mut queue = PictureQueue::new(bounds());
    let renderer = queue.begin_waiting("one", now).unwrap();
    queue.end_waiting("one", now);
    handle.end_driver();
    let ended: CancellationToken = handle.driver_ended();
    ended.cancelled().await;
    (state, queue, renderer, now)
}

fn draw(queue: &mut PictureQueue, renderer: &Arc<str>, now: Instant) -> bool {
    let Some(task) = queue.next(renderer, now, |_| true) else { return false };
    queue.begin_put(task.id, renderer, now, |_| true).unwrap();
    queue.end_put(task.id, Ok(drawn()), now)
}

#[tokio::test]
async fn a_renderer_that_asks_no_more_is_forgotten() {
    let (state, mut queue, _, now) = begun().await;
    assert!(queue.ask(order(&state, None), now + SECOND * 4).is_ok());
    let refused = queue.ask(order(&state, None), now + SECOND * 5).unwrap_err();
    assert!(matches!(refused, CallError::NoRenderer), "{refused}");
    assert!(queue.renderers(now + SECOND * 5).is_empty());
}

#[tokio::test]
async fn pictures_without_a_waiting_client_are_not_drawn() {
    let (state, mut queue, renderer, now) = begun().await;
    drop(queue.ask(order(&state, None), now).unwrap());
    assert!(queue.next(&renderer, now, |_| true).is_none());
}

#[tokio::test]
async fn clients_that_want_the_same_picture_share_its_task() {
    let (state, mut queue, renderer, now) = begun().await;
    let one = queue.ask(order(&state, Some(7)), now).unwrap();
    let other = queue.ask(order(&state, Some(7)), now).unwrap();
    assert!(draw(&mut queue, &renderer, now) && !draw(&mut queue, &renderer, now));
    let sequence = |waiting: &Waiting| waiting.borrow().clone().unwrap().unwrap().sequence;
    assert_eq!(sequence(&one), sequence(&other));
}

#[tokio::test]
async fn waiting_pictures_have_a_bound_in_number_and_in_bytes() {
    let (state, mut queue, _, now) = begun().await;
    let waiting: Vec<Waiting> = (0..3).map(|_| queue.ask(order(&state, None), now).unwrap()).collect();
    let refused = queue.ask(order(&state, None), now).unwrap_err().to_string();
    assert!(refused.contains("bytes of pictures"), "{refused}");
    let mut small = order(&state, None);
    small.view.planes = Planes::default();
    let fourth = queue.ask(small.clone(), now).unwrap();
    let refused = queue.ask(small, now).unwrap_err().to_string();
    assert!(refused.contains("pictures that are waited for would be 5"), "{refused}");
    drop((waiting, fourth));
}

#[tokio::test]
async fn the_oldest_kept_picture_makes_room() {
    let (state, mut queue, renderer, now) = begun().await;
    for camera in 1..=5 {
        let waiting = queue.ask(order(&state, Some(camera)), now).unwrap();
        assert!(draw(&mut queue, &renderer, now));
        drop(waiting);
    }
    let kept = (1..=5).map(|camera| queue.of_state(camera, 0).is_some());
    assert_eq!(kept.collect::<Vec<_>>(), [false, false, true, true, true]);
    queue.tidy(|camera| camera != 4, now);
    assert!(queue.of_state(4, 0).is_none() && queue.of_state(5, 0).is_some());
}

#[tokio::test]
async fn the_newest_sample_of_a_camera_is_drawn_and_the_others_are_counted() {
    let (state, mut queue, renderer, now) = begun().await;
    for _ in 0..4 {
        queue.due(order(&state, Some(7)), 0, now);
    }
    assert!(draw(&mut queue, &renderer, now) && !draw(&mut queue, &renderer, now));
    let camera = queue.camera(7, now);
    assert_eq!((camera.drawn, camera.missed), (1, 3));
    // A task of a renderer is not replaced by a newer one, and after its time it is not drawn again.
    queue.due(order(&state, Some(7)), 2, now);
    let late = queue.next(&renderer, now, |_| true).unwrap();
    queue.due(order(&state, Some(7)), 0, now);
    assert!(draw(&mut queue, &renderer, now + SECOND));
    assert!(queue.begin_put(late.id, &renderer, now + SECOND, |_| true).is_none());
    let camera = queue.camera(7, now);
    assert_eq!((camera.drawn, camera.missed), (2, 6));
}

#[tokio::test]
async fn a_picture_that_no_renderer_draws_is_given_up() {
    let (state, mut queue, renderer, mut now) = begun().await;
    let waiting = queue.ask(order(&state, None), now).unwrap();
    for _ in 0..3 {
        assert!(queue.next(&renderer, now, |_| true).is_some());
        assert!(queue.next(&renderer, now, |_| true).is_none(), "one has it already");
        assert_eq!(queue.next_expiry(), Some(now + SECOND));
        now += SECOND;
    }
    assert!(queue.next(&renderer, now, |_| true).is_none());
    let answer = waiting.borrow().clone().unwrap().unwrap_err().to_string();
    assert!(answer.contains("3 attempts"), "{answer}");
}

#[tokio::test]
async fn a_renderer_that_disconnects_while_sending_loses_its_task() {
    let (state, mut queue, renderer, now) = begun().await;
    let waiting = queue.ask(order(&state, None), now).unwrap();
    let task = queue.next(&renderer, now, |_| true).unwrap();
    queue.begin_put(task.id, &renderer, now, |_| true).unwrap();
    assert!(queue.begin_put(task.id, &renderer, now, |_| true).is_none(), "one comes already");
    queue.abandon_put(task.id);
    assert_eq!(queue.next(&renderer, now + SECOND, |_| true).unwrap().id, task.id);
    drop(waiting);
}

#[tokio::test]
async fn waiting_renderers_are_not_woken_repeatedly_while_a_picture_is_checked() {
    let (state, mut queue, renderer, now) = begun().await;
    let waiting = queue.ask(order(&state, None), now).unwrap();
    let task = queue.next(&renderer, now, |_| true).unwrap();
    assert_eq!(queue.next_expiry(), Some(now + SECOND));
    queue.begin_put(task.id, &renderer, now, |_| true).unwrap();
    assert_eq!(queue.next_expiry(), None, "its time would be over at once, again and again");
    queue.abandon_put(task.id);
    assert_eq!(queue.next_expiry(), Some(now + SECOND));
    drop(waiting);
}

#[tokio::test]
async fn a_renderer_that_takes_tasks_and_answers_none_holds_few_states_of_a_camera() {
    let (state, mut queue, renderer, now) = begun().await;
    let taken = (0..1000).filter(|_| {
        queue.due(order(&state, Some(7)), 0, now);
        queue.next(&renderer, now, |_| true).is_some()
    });
    assert_eq!(taken.count(), 16);
    assert_eq!(queue.camera(7, now).missed, 1000 - 16);
    // Another camera has its own share, and this one has it again in time.
    for (camera, at) in [(8, now), (7, now + SECOND)] {
        queue.due(order(&state, Some(camera)), 0, at);
        assert!(queue.next(&renderer, at, |_| true).is_some(), "{camera}");
    }
}

#[tokio::test]
async fn names_of_renderers_are_bounded_and_forgotten() {
    let (_, mut queue, _, now) = begun().await;
    for number in 1..64 {
        queue.begin_waiting(&number.to_string(), now).unwrap();
        queue.end_waiting(&number.to_string(), now);
    }
    let refused = queue.begin_waiting("another", now).unwrap_err();
    assert!(matches!(refused, CallError::LimitExceeded { .. }), "{refused}");
    queue.begin_waiting("another", now + SECOND * 60).unwrap();
}
