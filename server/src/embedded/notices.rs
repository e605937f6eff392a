//! What becomes of calls and subscriptions that were begun, as one queue that one thread empties.

use bytes::Bytes;
use tokio::sync::mpsc;

/// Notices that wait to be read. The sender of one more waits.
pub(super) const WAITING: usize = 256;

/// Numbers what was begun, from 1.
pub type Ticket = u64;

/// News of what was begun.
#[derive(Clone, Debug, PartialEq)]
pub struct Notice {
    /// Of the call or the subscription.
    pub ticket: Ticket,
    /// What it is.
    pub what: What,
}

/// What a notice says.
#[derive(Clone, Debug, PartialEq)]
pub enum What {
    /// An answer's message.
    Answer(Bytes),
    /// A refusal, as a `google.rpc.Status`. For a stream also how it ended, which may be OK.
    Refused(Vec<u8>),
    /// Nothing more comes.
    Ended,
    /// A publication.
    Published {
        /// The key that it has over Zenoh.
        key: String,
        /// Its message.
        payload: Vec<u8>,
    },
}

/// The sending end.
#[derive(Clone, Debug)]
pub(super) struct Notifier(mpsc::Sender<Notice>);

/// The receiving end.
#[derive(Debug)]
pub(super) struct Notices(mpsc::Receiver<Notice>);

/// Both ends.
pub(super) fn channel() -> (Notifier, Notices) {
    let (sender, receiver) = mpsc::channel(WAITING);
    (Notifier(sender), Notices(receiver))
}

impl Notifier {
    /// Sends a notice. Waits while [`WAITING`] are not read. A notice is lost where there is no receiver any more.
    pub(super) async fn notify(&self, ticket: Ticket, what: What) {
        drop(self.0.send(Notice { ticket, what }).await);
    }
}

impl Notices {
    /// Waits for a notice, and gives all that there are; none where there is no sender any more.
    pub(super) async fn next(&mut self) -> Vec<Notice> {
        let mut notices = Vec::new();
        self.0.recv_many(&mut notices, WAITING).await;
        notices
    }
}
