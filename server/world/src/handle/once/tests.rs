//! Requests that are sent more than once.

use std::sync::atomic::{AtomicU32, Ordering};

use super::super::{Caller, Transport};
use super::*;

fn named(name: &str) -> Scope {
    Scope::Named(Caller::said(name, Transport::Grpc).unwrap())
}

/// Returns a request of the client "bench" over the first connection.
fn asked(id: &str) -> IdentifiedRequest {
    IdentifiedRequest {
        scope: named("bench"),
        kind: "DeleteEntityRequest",
        id: id.to_owned(),
        digest: Sha256::of(b"arm"),
        peer: Some(connection(1)),
        is_secret: false,
    }
}

fn text(text: &str) -> Outcome {
    Outcome { bytes: Ok(Bytes::copy_from_slice(text.as_bytes())), is_transient: false }
}

/// Returns work that counts its executions and answers with the count.
fn counted(count: &Arc<AtomicU32>) -> impl Future<Output = Outcome> + Send + 'static + use<> {
    let count = count.clone();
    async move {
        tokio::task::yield_now().await;
        text(&(count.fetch_add(1, Ordering::Relaxed) + 1).to_string())
    }
}

/// Returns an answer of this size.
async fn long(bytes: usize) -> Outcome {
    Outcome { bytes: Ok(vec![0; bytes].into()), is_transient: false }
}

fn connection(number: u64) -> Peer {
    Peer::Connection { number, address: std::net::Ipv4Addr::LOCALHOST.into() }
}

const KEPT: usize = 1024;
const MAX_UNDER_WAY: usize = KEPT / 2;
const MAX_WEIGHT: usize = 64 << 20;
const KEPT_FOR: Duration = Duration::from_secs(3600);

impl AnswerCache {
    async fn give(&self, request: IdentifiedRequest, count: &Arc<AtomicU32>) -> String {
        String::from_utf8(self.once(request, Ok(counted(count))).await.unwrap().bytes.unwrap().to_vec())
            .unwrap()
    }

    fn number(&self) -> usize {
        self.lock().by_key.len()
    }
}

fn reused(refused: Result<Outcome, CallError>) -> String {
    match refused {
        Err(CallError::RequestIdReused { id, how }) => {
            assert_eq!(id, "a");
            how
        }
        other => panic!("{other:?}"),
    }
}

#[tokio::test]
async fn the_same_request_gets_the_first_answer_again() {
    let (answers, count) = (AnswerCache::new(&DaemonLimits::default()), Arc::default());
    for _ in 0..3 {
        assert_eq!(answers.give(asked("a"), &count).await, "1");
    }
    assert_eq!(answers.give(asked("b"), &count).await, "2");
}

#[tokio::test]
async fn an_id_is_that_of_one_caller_and_one_kind_of_request() {
    let (answers, count) = (AnswerCache::new(&DaemonLimits::default()), Arc::default());
    let first = IdentifiedRequest { peer: Some(connection(7)), ..asked("a") };
    assert_eq!(answers.give(first, &count).await, "1");
    let others = [
        IdentifiedRequest { scope: named("viewer"), ..asked("a") },
        IdentifiedRequest {
            scope: Scope::Named(Caller::said("bench", Transport::Zenoh).unwrap()),
            ..asked("a")
        },
        IdentifiedRequest { scope: Scope::Unnamed(connection(1)), ..asked("a") },
        IdentifiedRequest { scope: Scope::Unnamed(connection(2)), ..asked("a") },
        IdentifiedRequest { scope: Scope::Unnamed(Peer::Session("1".into())), ..asked("a") },
        IdentifiedRequest { kind: "RestoreStateRequest", ..asked("a") },
    ];
    for (other, answer) in others.into_iter().zip(2..) {
        assert_eq!(answers.give(other, &count).await, answer.to_string());
    }
    assert_eq!(
        answers.give(asked("a"), &count).await,
        "1",
        "a named client may come over another connection"
    );
}

#[tokio::test]
async fn an_id_of_another_request_is_refused_and_its_work_is_not_done() {
    let (answers, count) = (AnswerCache::new(&DaemonLimits::default()), Arc::default());
    assert_eq!(answers.give(asked("a"), &count).await, "1");
    let other = IdentifiedRequest { digest: Sha256::of(b"hand"), ..asked("a") };
    assert!(reused(answers.once(other, Ok(counted(&count))).await).contains("another request"));
    assert_eq!(count.load(Ordering::Relaxed), 1);
    assert_eq!(answers.give(asked("a"), &count).await, "1");
}

#[tokio::test]
async fn a_secret_is_given_again_over_the_connection_that_asked_first_and_no_other() {
    let (answers, count) = (AnswerCache::new(&DaemonLimits::default()), Arc::default());
    let secret = || IdentifiedRequest { is_secret: true, ..asked("a") };
    for _ in 0..2 {
        assert_eq!(answers.give(secret(), &count).await, "1");
    }
    for peer in [None, Some(connection(2)), Some(Peer::Process)] {
        let other = IdentifiedRequest { peer, ..secret() };
        assert!(reused(answers.once(other, Ok(counted(&count))).await).contains("secret"));
    }
    // If callers cannot be distinguished, none gets it.
    let answers = AnswerCache::new(&DaemonLimits::default());
    let unknown = || IdentifiedRequest { peer: None, ..secret() };
    answers.give(unknown(), &count).await;
    assert!(reused(answers.once(unknown(), Ok(counted(&count))).await).contains("secret"));
}

#[tokio::test]
async fn a_duplicate_that_comes_too_early_waits_for_the_first() {
    let (answers, count) = (AnswerCache::new(&DaemonLimits::default()), Arc::default());
    let both = tokio::join!(answers.give(asked("a"), &count), answers.give(asked("a"), &count));
    assert_eq!(both, ("1".to_owned(), "1".to_owned()));
}

#[tokio::test]
async fn work_is_done_although_its_caller_goes_away() {
    let (answers, count) = (AnswerCache::new(&DaemonLimits::default()), Arc::default());
    {
        let mut first = std::pin::pin!(answers.once(asked("a"), Ok(counted(&count))));
        let polled = std::future::poll_fn(|cx| std::task::Poll::Ready(first.as_mut().poll(cx))).await;
        assert!(polled.is_pending());
    }
    assert_eq!(answers.give(asked("a"), &count).await, "1");
}

#[tokio::test]
async fn a_refusal_is_an_answer_unless_it_is_transient() {
    let answers = AnswerCache::new(&DaemonLimits::default());
    let refuse =
        |is_transient| async move { Outcome { bytes: Err(Bytes::from_static(b"no")), is_transient } };
    for _ in 0..2 {
        let refused = answers.once(asked("a"), Ok(refuse(false))).await.unwrap();
        assert_eq!(refused.bytes, Err(Bytes::from_static(b"no")));
    }
    let again = answers.once(asked("a"), Ok(async { text("yes") })).await.unwrap();
    assert_eq!(again.bytes, Err(Bytes::from_static(b"no")));
    answers.once(asked("b"), Ok(refuse(true))).await.unwrap();
    let again = answers.once(asked("b"), Ok(async { text("yes") })).await.unwrap();
    assert_eq!(again.bytes, Ok(Bytes::from_static(b"yes")));
}

#[tokio::test]
async fn work_that_panics_is_a_fault_and_may_be_tried_again() {
    let (answers, count) = (AnswerCache::new(&DaemonLimits::default()), Arc::default());
    let panicked = answers.once(asked("a"), Ok(async { panic!("on purpose") })).await;
    assert!(matches!(panicked, Err(CallError::Internal { .. })));
    assert_eq!(answers.give(asked("a"), &count).await, "1");
    assert_eq!(answers.weight(), ENTRY + 2 + 1);
}

#[tokio::test]
async fn only_the_last_ids_are_kept() {
    let (answers, count) = (AnswerCache::new(&DaemonLimits::default()), Arc::default());
    for id in 0..=KEPT {
        answers.give(asked(&id.to_string()), &count).await;
    }
    assert_eq!(answers.number(), KEPT);
    assert_eq!(answers.give(asked("1"), &count).await, "2", "still kept");
    assert_eq!(answers.give(asked("0"), &count).await, (KEPT + 2).to_string(), "forgotten");
    let long = answers.once(asked(&"a".repeat(MAX_ID + 1)), Ok(counted(&count))).await;
    assert!(matches!(long, Err(CallError::InvalidValue { .. })));
}

#[tokio::test]
async fn answers_and_refusals_that_are_too_large_together_push_out_the_oldest() {
    let (answers, count) = (AnswerCache::new(&DaemonLimits::default()), Arc::default());
    let refusal = async { Outcome { bytes: Err(vec![0; MAX_WEIGHT / 2].into()), is_transient: false } };
    answers.once(asked("a"), Ok(long(MAX_WEIGHT / 4))).await.unwrap();
    answers.once(asked("b"), Ok(refusal)).await.unwrap();
    assert_eq!(answers.number(), 2);
    answers.once(asked("c"), Ok(long(MAX_WEIGHT / 3))).await.unwrap();
    assert_eq!(answers.number(), 2);
    assert_eq!(answers.give(asked("a"), &count).await, "1", "the oldest is forgotten");
    assert!(answers.weight() <= MAX_WEIGHT);
    // The newest answer stays, whatever its size.
    answers.once(asked("d"), Ok(long(2 * MAX_WEIGHT))).await.unwrap();
    assert_eq!(answers.number(), 1);
    assert_eq!(answers.weight(), ENTRY + 2 + 2 * MAX_WEIGHT);
}

#[tokio::test(start_paused = true)]
async fn answers_are_forgotten_after_a_time() {
    let (answers, count) = (AnswerCache::new(&DaemonLimits::default()), Arc::default());
    answers.give(asked("a"), &count).await;
    tokio::time::advance(KEPT_FOR / 2).await;
    answers.give(asked("b"), &count).await;
    tokio::time::advance(KEPT_FOR / 2).await;
    answers.tidy(Instant::now());
    assert_eq!(answers.number(), 1);
    tokio::time::advance(KEPT_FOR / 2).await;
    answers.tidy(Instant::now());
    assert_eq!((answers.number(), answers.weight()), (0, 0));
}

/// Executes the work of `number` requests of one caller.
async fn flood(answers: &AnswerCache, name: &str, number: usize, bytes: usize) {
    for id in 0..number {
        let asked = IdentifiedRequest { scope: named(name), ..asked(&format!("{id} of a flood")) };
        answers.once(asked, Ok(long(bytes))).await.unwrap();
    }
}

#[tokio::test]
async fn a_flood_by_one_caller_leaves_the_answers_of_others() {
    let (answers, count) = (AnswerCache::new(&DaemonLimits::default()), Arc::default());
    assert_eq!(answers.give(asked("a"), &count).await, "1");
    flood(&answers, "flooder", 2 * KEPT, 0).await;
    assert_eq!(answers.give(asked("a"), &count).await, "1", "a flood of requests");
    flood(&answers, "flooder", 16, MAX_WEIGHT / 8).await;
    assert_eq!(answers.give(asked("a"), &count).await, "1", "a flood of bytes");
    assert!(answers.number() <= KEPT && answers.weight() <= MAX_WEIGHT);
}

#[tokio::test]
async fn a_request_that_is_under_way_is_not_done_again_however_many_come_after_it() {
    let (answers, count) = (AnswerCache::new(&DaemonLimits::default()), Arc::default());
    let (end, ended) = tokio::sync::oneshot::channel::<()>();
    let slow = async move {
        ended.await.unwrap();
        text("slow")
    };
    let mut first = std::pin::pin!(answers.once(asked("a"), Ok(slow)));
    let polled = std::future::poll_fn(|cx| std::task::Poll::Ready(first.as_mut().poll(cx))).await;
    assert!(polled.is_pending());
    flood(&answers, "bench", 2 * KEPT, 0).await;
    let mut again = std::pin::pin!(answers.once(asked("a"), Ok(counted(&count))));
    let polled = std::future::poll_fn(|cx| std::task::Poll::Ready(again.as_mut().poll(cx))).await;
    assert!(polled.is_pending());
    end.send(()).unwrap();
    assert_eq!(again.await.unwrap().bytes, Ok(Bytes::from_static(b"slow")));
    assert_eq!(first.await.unwrap().bytes, Ok(Bytes::from_static(b"slow")));
    assert_eq!(count.load(Ordering::Relaxed), 0);
}

#[tokio::test]
async fn refusals_that_pass_push_out_no_answers() {
    let (answers, count) = (AnswerCache::new(&DaemonLimits::default()), Arc::default());
    assert_eq!(answers.give(asked("a"), &count).await, "1");
    for id in 0..2 * KEPT {
        let full = async { Outcome { bytes: Err(Bytes::from_static(b"full")), is_transient: true } };
        answers.once(asked(&format!("{id} is refused")), Ok(full)).await.unwrap();
    }
    assert_eq!(answers.give(asked("a"), &count).await, "1");
}

#[tokio::test]
async fn one_caller_leaves_others_room_for_requests_under_way() {
    let (answers, count) = (AnswerCache::new(&DaemonLimits::default()), Arc::default());
    let begin = |name: &str, number: usize| {
        let asked = IdentifiedRequest { scope: named(name), ..asked(&number.to_string()) };
        answers.find_or_begin(asked, Ok(std::future::pending()))
    };
    for number in 0..MAX_UNDER_WAY {
        begin("bench", number).unwrap();
    }
    let refused = begin("bench", MAX_UNDER_WAY).unwrap_err();
    let expected = "in progress, of one caller, would be 513, and the limit is 512";
    assert!(refused.to_string().contains(expected), "{refused}");
    let other = || IdentifiedRequest { scope: named("viewer"), ..asked("a") };
    assert_eq!(answers.give(other(), &count).await, "1");
    for number in 0..KEPT - MAX_UNDER_WAY {
        begin("third", number).unwrap();
    }
    // This caller has none in progress.
    let refused = answers.once(other(), Ok(counted(&count))).await.unwrap_err().to_string();
    assert!(refused.contains("in progress, of all callers"), "{refused}");
    assert!(refused.contains("would be 1025, and the limit is 1024"), "{refused}");
    assert_eq!(answers.number(), KEPT);
}

#[tokio::test]
async fn a_caller_that_may_not_have_work_done_gets_the_answer_to_it_and_begins_none() {
    let (answers, count) = (AnswerCache::new(&DaemonLimits::default()), Arc::default());
    let forbidden = || answers.once::<std::future::Ready<Outcome>>(asked("a"), Err(CallError::ShuttingDown));
    assert!(matches!(forbidden().await, Err(CallError::ShuttingDown)));
    assert_eq!(answers.number(), 0);
    assert_eq!(answers.give(asked("a"), &count).await, "1");
    assert_eq!(forbidden().await.unwrap().bytes, Ok(Bytes::from_static(b"1")));
}
