//! What becomes of calls and subscriptions that were begun, as one queue that one thread empties.

use bytes::Bytes;
use tokio::sync::mpsc;

/// Notices that wait to be heard; whoever tells one more waits.
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

/// What there is to tell.
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

/// The end of those who tell.
#[derive(Clone, Debug)]
pub(super) struct Teller(mpsc::Sender<Notice>);

/// The end of the one who hears.
#[derive(Debug)]
pub(super) struct Hearing(mpsc::Receiver<Notice>);

/// Both ends.
pub(super) fn channel() -> (Teller, Hearing) {
    let (sender, receiver) = mpsc::channel(WAITING);
    (Teller(sender), Hearing(receiver))
}

impl Teller {
    /// Waits where too many are not heard yet. One that will not be heard any more is lost.
    pub(super) async fn tell(&self, ticket: Ticket, what: What) {
        drop(self.0.send(Notice { ticket, what }).await);
    }
}

impl Hearing {
    /// All that waits, once there is one; none where no one can tell any more.
    pub(super) async fn next(&mut self) -> Vec<Notice> {
        let mut notices = Vec::new();
        self.0.recv_many(&mut notices, WAITING).await;
        notices
    }
}
