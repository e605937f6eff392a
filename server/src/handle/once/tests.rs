//! Requests that are sent more than once.

use std::sync::atomic::{AtomicU32, Ordering};

use super::super::{Caller, Transport};
use super::*;

fn named(name: &str) -> Scope {
    Scope::Named(Caller::said(name, Transport::Grpc).unwrap())
}

/// A request of the client "bench" over the first connection.
fn asked(id: &str) -> Asked {
    Asked {
        scope: named("bench"),
        kind: "DeleteEntityRequest",
        id: id.to_owned(),
        digest: Sha256::of(b"arm"),
        peer: Some(Peer::Connection(1)),
        is_secret: false,
    }
}

fn text(text: &str) -> Outcome {
    Outcome { bytes: Ok(Bytes::copy_from_slice(text.as_bytes())), is_passing: false }
}

/// Work that counts how often it is done and answers with the count.
fn counted(count: &Arc<AtomicU32>) -> impl Future<Output = Outcome> + Send + 'static + use<> {
    let count = count.clone();
    async move {
        tokio::task::yield_now().await;
        text(&(count.fetch_add(1, Ordering::Relaxed) + 1).to_string())
    }
}

/// An answer of so many bytes.
async fn long(bytes: usize) -> Outcome {
    Outcome { bytes: Ok(vec![0; bytes].into()), is_passing: false }
}

impl Answers {
    async fn give(&self, asked: Asked, count: &Arc<AtomicU32>) -> String {
        String::from_utf8(self.once(asked, counted(count)).await.unwrap().bytes.unwrap().to_vec()).unwrap()
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
    let (answers, count) = (Answers::default(), Arc::default());
    for _ in 0..3 {
        assert_eq!(answers.give(asked("a"), &count).await, "1");
    }
    assert_eq!(answers.give(asked("b"), &count).await, "2");
}

#[tokio::test]
async fn an_id_is_that_of_one_caller_and_one_kind_of_request() {
    let (answers, count) = (Answers::default(), Arc::default());
    let first = Asked { peer: Some(Peer::Connection(7)), ..asked("a") };
    assert_eq!(answers.give(first, &count).await, "1");
    let others = [
        Asked { scope: named("viewer"), ..asked("a") },
        Asked { scope: Scope::Named(Caller::said("bench", Transport::Zenoh).unwrap()), ..asked("a") },
        Asked { scope: Scope::Unnamed(Peer::Connection(1)), ..asked("a") },
        Asked { scope: Scope::Unnamed(Peer::Connection(2)), ..asked("a") },
        Asked { scope: Scope::Unnamed(Peer::Session("1".into())), ..asked("a") },
        Asked { kind: "RestoreStateRequest", ..asked("a") },
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
    let (answers, count) = (Answers::default(), Arc::default());
    assert_eq!(answers.give(asked("a"), &count).await, "1");
    let other = Asked { digest: Sha256::of(b"hand"), ..asked("a") };
    assert!(reused(answers.once(other, counted(&count)).await).contains("another request"));
    assert_eq!(count.load(Ordering::Relaxed), 1);
    assert_eq!(answers.give(asked("a"), &count).await, "1");
}

#[tokio::test]
async fn a_secret_is_given_again_over_the_connection_that_asked_first_and_no_other() {
    let (answers, count) = (Answers::default(), Arc::default());
    let secret = || Asked { is_secret: true, ..asked("a") };
    for _ in 0..2 {
        assert_eq!(answers.give(secret(), &count).await, "1");
    }
    for peer in [None, Some(Peer::Connection(2)), Some(Peer::Process)] {
        let other = Asked { peer, ..secret() };
        assert!(reused(answers.once(other, counted(&count)).await).contains("secret"));
    }
    // Where nobody can be told from another, nobody gets it.
    let answers = Answers::default();
    let unknown = || Asked { peer: None, ..secret() };
    answers.give(unknown(), &count).await;
    assert!(reused(answers.once(unknown(), counted(&count)).await).contains("secret"));
}

#[tokio::test]
async fn a_duplicate_that_comes_too_early_waits_for_the_first() {
    let (answers, count) = (Answers::default(), Arc::default());
    let both = tokio::join!(answers.give(asked("a"), &count), answers.give(asked("a"), &count));
    assert_eq!(both, ("1".to_owned(), "1".to_owned()));
}

#[tokio::test]
async fn work_is_done_although_its_caller_goes_away() {
    let (answers, count) = (Answers::default(), Arc::default());
    {
        let mut first = std::pin::pin!(answers.once(asked("a"), counted(&count)));
        let polled = std::future::poll_fn(|cx| std::task::Poll::Ready(first.as_mut().poll(cx))).await;
        assert!(polled.is_pending());
    }
    assert_eq!(answers.give(asked("a"), &count).await, "1");
}

#[tokio::test]
async fn a_refusal_is_an_answer_and_one_that_passes_by_itself_is_none() {
    let answers = Answers::default();
    let refuse = |is_passing| async move { Outcome { bytes: Err(Bytes::from_static(b"no")), is_passing } };
    for _ in 0..2 {
        let refused = answers.once(asked("a"), refuse(false)).await.unwrap();
        assert_eq!(refused.bytes, Err(Bytes::from_static(b"no")));
    }
    let again = answers.once(asked("a"), async { text("yes") }).await.unwrap();
    assert_eq!(again.bytes, Err(Bytes::from_static(b"no")));
    answers.once(asked("b"), refuse(true)).await.unwrap();
    let again = answers.once(asked("b"), async { text("yes") }).await.unwrap();
    assert_eq!(again.bytes, Ok(Bytes::from_static(b"yes")));
}

#[tokio::test]
async fn work_that_panics_is_a_fault_and_may_be_tried_again() {
    let (answers, count) = (Answers::default(), Arc::default());
    let panicked = answers.once(asked("a"), async { panic!("on purpose") }).await;
    assert!(matches!(panicked, Err(CallError::Internal { .. })));
    assert_eq!(answers.give(asked("a"), &count).await, "1");
    assert_eq!(answers.weight(), ENTRY + 2 + 1);
}

#[tokio::test]
async fn only_the_last_ids_are_kept() {
    let (answers, count) = (Answers::default(), Arc::default());
    for id in 0..=KEPT {
        answers.give(asked(&id.to_string()), &count).await;
    }
    assert_eq!(answers.number(), KEPT);
    assert_eq!(answers.give(asked("1"), &count).await, "2", "still kept");
    assert_eq!(answers.give(asked("0"), &count).await, (KEPT + 2).to_string(), "forgotten");
    let long = answers.once(asked(&"a".repeat(MAX_ID + 1)), counted(&count)).await;
    assert!(matches!(long, Err(CallError::InvalidValue { .. })));
}

#[tokio::test]
async fn answers_and_refusals_that_are_too_large_together_push_out_the_oldest() {
    let (answers, count) = (Answers::default(), Arc::default());
    let refusal = async { Outcome { bytes: Err(vec![0; MAX_WEIGHT / 2].into()), is_passing: false } };
    answers.once(asked("a"), long(MAX_WEIGHT / 4)).await.unwrap();
    answers.once(asked("b"), refusal).await.unwrap();
    assert_eq!(answers.number(), 2);
    answers.once(asked("c"), long(MAX_WEIGHT / 3)).await.unwrap();
    assert_eq!(answers.number(), 2);
    assert_eq!(answers.give(asked("a"), &count).await, "1", "the oldest is forgotten");
    assert!(answers.weight() <= MAX_WEIGHT);
    // The newest stays, however long it is.
    answers.once(asked("d"), long(2 * MAX_WEIGHT)).await.unwrap();
    assert_eq!(answers.number(), 1);
    assert_eq!(answers.weight(), ENTRY + 2 + 2 * MAX_WEIGHT);
}

#[tokio::test(start_paused = true)]
async fn answers_are_forgotten_after_a_time() {
    let (answers, count) = (Answers::default(), Arc::default());
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
