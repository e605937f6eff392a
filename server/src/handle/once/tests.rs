//! Requests that are sent more than once.

use std::sync::atomic::{AtomicU32, Ordering};

use super::*;

impl Answers {
    async fn weightless<T, W>(&self, id: &str, work: W) -> Result<T, CallError>
    where
        T: Clone + Send + Sync + 'static,
        W: Future<Output = Result<T, CallError>> + Send + 'static,
    {
        self.once(id, |_| 0, work).await
    }
}

/// Work that counts how often it is done and answers with the count.
fn counted(count: &Arc<AtomicU32>) -> impl Future<Output = Result<u32, CallError>> + Send + 'static + use<> {
    let count = count.clone();
    async move {
        tokio::task::yield_now().await;
        Ok(count.fetch_add(1, Ordering::Relaxed) + 1)
    }
}

#[tokio::test]
async fn the_same_id_gets_the_first_answer_again() {
    let (answers, count) = (Answers::default(), Arc::default());
    for _ in 0..3 {
        assert_eq!(answers.weightless("a", counted(&count)).await.unwrap(), 1);
    }
    assert_eq!(answers.weightless("b", counted(&count)).await.unwrap(), 2);
    assert_eq!(answers.weightless("", counted(&count)).await.unwrap(), 3);
    assert_eq!(answers.weightless("", counted(&count)).await.unwrap(), 4, "no id, no memory");
}

#[tokio::test]
async fn a_duplicate_that_comes_too_early_waits_for_the_first() {
    let (answers, count) = (Answers::default(), Arc::default());
    let both =
        tokio::join!(answers.weightless("a", counted(&count)), answers.weightless("a", counted(&count)));
    assert_eq!((both.0.unwrap(), both.1.unwrap()), (1, 1));
}

#[tokio::test]
async fn work_is_done_weightlessthough_its_caller_goes_away() {
    let (answers, count) = (Answers::default(), Arc::default());
    {
        let mut first = std::pin::pin!(answers.weightless("a", counted(&count)));
        let polled = std::future::poll_fn(|cx| std::task::Poll::Ready(first.as_mut().poll(cx))).await;
        assert!(polled.is_pending());
    }
    assert_eq!(answers.weightless("a", counted(&count)).await.unwrap(), 1);
}

#[tokio::test]
async fn a_refusal_is_an_answer_and_a_full_mailbox_is_none() {
    let answers = Answers::default();
    let refuse = async || {
        answers.weightless::<u32, _>("a", async { Err(simd_core::Error::ClaimNotFound.into()) }).await
    };
    assert!(matches!(refuse().await, Err(CallError::World(_))));
    let again = answers.weightless("a", async { Ok(7_u32) }).await;
    assert!(matches!(again, Err(CallError::World(_))));

    for error in [CallError::MailboxFull { capacity: 1 }, CallError::ShuttingDown] {
        assert!(answers.weightless::<u32, _>("b", async { Err(error) }).await.is_err());
    }
    assert_eq!(answers.weightless("b", async { Ok(7_u32) }).await.unwrap(), 7);
}

#[tokio::test]
async fn work_that_panics_is_a_fault_and_may_be_tried_again() {
    let answers = Answers::default();
    let panicked = answers.weightless::<u32, _>("a", async { panic!("on purpose") }).await;
    assert!(matches!(panicked, Err(CallError::Internal { .. })));
    assert_eq!(answers.weightless("a", async { Ok(7_u32) }).await.unwrap(), 7);
}

#[tokio::test]
async fn an_id_of_another_kind_of_request_is_refused() {
    let answers = Answers::default();
    assert_eq!(answers.weightless("a", async { Ok(7_u32) }).await.unwrap(), 7);
    let other = answers.weightless("a", async { Ok(String::new()) }).await;
    assert!(matches!(other, Err(CallError::InvalidValue { .. })));
}

#[tokio::test]
async fn only_the_last_ids_are_kept() {
    let (answers, count) = (Answers::default(), Arc::default());
    for id in 0..=KEPT {
        answers.weightless(&id.to_string(), counted(&count)).await.unwrap();
    }
    assert_eq!(answers.lock().by_id.len(), KEPT);
    assert_eq!(answers.weightless("1", counted(&count)).await.unwrap(), 2, "still kept");
    assert_eq!(answers.weightless("0", counted(&count)).await.unwrap(), KEPT as u32 + 2, "forgotten");
}

#[tokio::test]
async fn answers_that_weigh_too_much_together_push_out_the_oldest() {
    let (answers, count) = (Answers::default(), Arc::default());
    let half = |_: &u32| MAX_WEIGHT / 2;
    for (id, answer) in [("a", 1), ("b", 2), ("a", 1), ("b", 2), ("c", 3), ("b", 2), ("a", 4), ("c", 3)] {
        assert_eq!(answers.once(id, half, counted(&count)).await.unwrap(), answer, "{id}");
    }
    // The newest stays, however much it weighs.
    for _ in 0..2 {
        assert_eq!(answers.once("d", |_| 2 * MAX_WEIGHT, counted(&count)).await.unwrap(), 5);
    }
    assert_eq!(answers.lock().by_id.len(), 1);
}
