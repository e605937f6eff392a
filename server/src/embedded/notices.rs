//! Results of begun calls and subscriptions, as one queue that one thread empties.

use bytes::Bytes;
use tokio::sync::mpsc;

/// Capacity of the queue, notices. Senders wait while it is full.
pub(super) const WAITING: usize = 256;

/// Number of a begun call or subscription, from 1.
pub type Ticket = u64;

/// News about a begun call or subscription.
#[derive(Clone, Debug, PartialEq)]
pub struct Notice {
    /// Ticket of the call or the subscription.
    pub ticket: Ticket,
    /// Content.
    pub what: What,
}

/// Content of a notice.
#[derive(Clone, Debug, PartialEq)]
pub enum What {
    /// Message of an answer.
    Answer(Bytes),
    /// A refusal, as a `google.rpc.Status`. For a stream also its end, which may be OK.
    Refused(Vec<u8>),
    /// The end.
    Ended,
    /// A publication.
    Published {
        /// Key of the publication over Zenoh.
        key: String,
        /// Message.
        payload: Vec<u8>,
    },
}

/// The sending end.
#[derive(Clone, Debug)]
pub(super) struct Notifier(mpsc::Sender<Notice>);

/// The receiving end.
#[derive(Debug)]
pub(super) struct Notices(mpsc::Receiver<Notice>);

/// Returns both ends.
pub(super) fn channel() -> (Notifier, Notices) {
    let (sender, receiver) = mpsc::channel(WAITING);
    (Notifier(sender), Notices(receiver))
}

impl Notifier {
    /// Sends a notice, and waits while the queue is full. The notice is lost if the receiver is gone.
    pub(super) async fn notify(&self, ticket: Ticket, what: What) {
        drop(self.0.send(Notice { ticket, what }).await);
    }
}

impl Notices {
    /// Waits for a notice, and returns all available ones; none if the last sender is gone.
    pub(super) async fn next(&mut self) -> Vec<Notice> {
        let mut notices = Vec::new();
        self.0.recv_many(&mut notices, WAITING).await;
        notices
    }
}
