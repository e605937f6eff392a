//! Joint targets as publications: accepted in order, without an answer. Refusals are counted, and logged at
//! most once per second.
//!
//! Bounded: targets that arrive while [`WAITING`] messages wait, or the bytes of one largest message, are
//! lost and counted. The next one is newer anyway. A message that exceeds the maximum of a call is refused
//! unread.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use futures_util::StreamExt as _;
use simd_core::Command;
use simd_proto::access::{TOKEN_HEADER, parse_bearer};
use simd_proto::{CLIENT_HEADER, checked, keys, v1};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc};
use tokio::time::{Interval, MissedTickBehavior, interval};
use tokio_stream::wrappers::ReceiverStream;
use tokio_util::sync::CancellationToken;
use zenoh::Session;
use zenoh::bytes::ZBytes;

use super::Error;
use super::proofs::{MAX_ATTACHMENT_BYTES, proven};
use simd_api::convert::from_proto::joint::set_joint_targets;
use simd_api::service::claims::{Presented, Proven};
use simd_world::SimHandle;
use simd_world::access::{Grant, role_of};
use simd_world::account::Account;
use simd_world::handle::{CallContext, Caller, RefusedUnanswered, Transport};

/// Maximum number of messages that wait to be read.
const WAITING: usize = 256;
/// Maximum number of commands that wait for their step.
const UNDER_WAY: usize = 64;
/// Upper bound of the limit of messages' bytes.
const MAX_BYTES: usize = 1 << 28;
/// Time between two logged summaries of refusals.
const REPORT: Duration = Duration::from_secs(1);

/// Targets, with their proof and headers.
#[derive(Debug)]
struct Sent {
    payload: ZBytes,
    attachment: Option<ZBytes>,
    proven: Proven,
    /// Held until the targets are set or refused.
    _room: OwnedSemaphorePermit,
}

/// Inbox of messages for the reading task.
struct Inbox {
    sender: mpsc::Sender<Sent>,
    /// Permits, one per byte.
    room: Arc<Semaphore>,
    /// Maximum bytes of one message, and of all messages waiting or in progress.
    limit: usize,
    lost: Arc<AtomicU64>,
    long: Arc<AtomicU64>,
}

impl Inbox {
    /// Runs on Zenoh's own thread, without waiting. `prove` checks the message's proof, if the message is
    /// accepted.
    fn take(&self, payload: &ZBytes, attachment: Option<&ZBytes>, prove: impl FnOnce() -> Proven) {
        let bytes = payload.len() + attachment.map_or(0, ZBytes::len);
        if bytes > self.limit {
            self.long.fetch_add(1, Ordering::Relaxed);
            return;
        }
        let room =
            u32::try_from(bytes).ok().and_then(|bytes| self.room.clone().try_acquire_many_owned(bytes).ok());
        let sent = room.map(|room| {
            let (payload, attachment) = (payload.clone(), attachment.cloned());
            Sent { payload, attachment, proven: prove(), _room: room }
        });
        if sent.is_none_or(|sent| self.sender.try_send(sent).is_err()) {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// Accepts targets from now on.
pub(super) async fn serve(
    session: &Session,
    name: &str,
    handle: &SimHandle,
    ended: &CancellationToken,
) -> Result<(), Error> {
    let (inbox, receiver) = inbox(handle.info().limits.message_bytes);
    let refusals = Refusals::new(&inbox);
    let prover = handle.clone();
    let subscriber = session.declare_subscriber(keys::joint_targets(name)).callback(move |sample| {
        let (payload, attachment) = (sample.payload(), sample.attachment());
        inbox.take(payload, attachment, || proven(&prover, sample.key_expr(), Some(payload), attachment));
    });
    subscriber.background().await.map_err(Error::session)?;
    tokio::spawn(ended.clone().run_until_cancelled_owned(take(handle.clone(), receiver, refusals)));
    Ok(())
}

/// Makes an inbox for messages of at most `limit` bytes.
fn inbox(limit: u64) -> (Inbox, mpsc::Receiver<Sent>) {
    let (sender, receiver) = mpsc::channel(WAITING);
    let limit = usize::try_from(limit).unwrap_or(usize::MAX).min(MAX_BYTES);
    let (lost, long) = Default::default();
    (Inbox { sender, room: Arc::new(Semaphore::new(limit)), limit, lost, long }, receiver)
}

async fn take(handle: SimHandle, receiver: mpsc::Receiver<Sent>, mut refusals: Refusals) {
    // Polled in order, so that they enter the mailbox in order.
    let mut results = ReceiverStream::new(receiver).map(|sent| set(&handle, sent)).buffered(UNDER_WAY);
    loop {
        tokio::select! {
            result = results.next() => match result {
                Some(Ok(())) => {}
                Some(Err(sentence)) => refusals.count(sentence),
                None => return,
            },
            _tick = refusals.ticks.tick() => refusals.report(&handle.refused_unanswered()),
        }
    }
}

async fn set(handle: &SimHandle, sent: Sent) -> Result<(), String> {
    let grant = check(handle, sent.attachment.as_ref())?;
    let request: v1::SetJointTargetsRequest = checked::decode(&sent.payload.to_bytes())
        .map_err(|error| format!("the payload is not a SetJointTargetsRequest: {error}"))?;
    let claim = Presented::Id(sent.proven).claim(handle, &request.claim);
    let claim = claim.map_err(|error| error.to_string())?;
    let mut targets = set_joint_targets(request).map_err(|error| error.to_string())?;
    let caller = sent.attachment.as_ref().and_then(|attachment| caller(&attachment.to_bytes()));
    let account = match (&grant, &caller) {
        (Some(grant), _) => Account::Token(grant.name.as_str().into()),
        (None, Some(caller)) => Account::Session(Arc::clone(&caller.name)),
        (None, None) => Account::Unknown,
    };
    let call = CallContext { transport: Transport::Zenoh, caller, grant, claim, ..CallContext::of(account) };
    let handle = handle.of_call(call);
    targets.source = Some(handle.target_source());
    handle.command(Command::SetTargets(targets)).await.map_err(|error| error.to_string())?;
    if let Some(caller) = handle.call().caller.clone() {
        // The client is present, though it gets no answer.
        drop(handle.begin_call(caller));
    }
    Ok(())
}

/// Returns the rights of an attachment's token, if tokens are required and it allows targets.
fn check(handle: &SimHandle, attachment: Option<&ZBytes>) -> Result<Option<Arc<Grant>>, String> {
    if !handle.access().is_required() {
        return Ok(None);
    }
    let attachment = attachment.filter(|attachment| attachment.len() <= MAX_ATTACHMENT_BYTES);
    let text = attachment.map(|attachment| String::from_utf8_lossy(&attachment.to_bytes()).into_owned());
    let token = text.as_deref().and_then(|text| parse_bearer(keys::parse_attachment(text, TOKEN_HEADER)?));
    let needed = role_of("JointService", "SetJointTargets");
    let granted = handle.access().check(token, needed, "SetJointTargets");
    granted.map_err(|denied| denied.to_string())
}

/// Returns the publishing client, from the attachment.
fn caller(attachment: &[u8]) -> Option<Caller> {
    let text = String::from_utf8_lossy(attachment);
    Caller::said(keys::parse_attachment(&text, CLIENT_HEADER)?, Transport::Zenoh)
}

/// Refusals since the last log line.
struct Refusals {
    number: u64,
    /// Reason of the last refusal.
    last: String,
    lost: Arc<AtomicU64>,
    long: Arc<AtomicU64>,
    /// Maximum bytes of a message.
    limit: usize,
    ticks: Interval,
}

impl Refusals {
    fn new(inbox: &Inbox) -> Self {
        let mut ticks = interval(REPORT);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let (lost, long) = (inbox.lost.clone(), inbox.long.clone());
        Self { number: 0, last: String::new(), lost, long, limit: inbox.limit, ticks }
    }

    fn count(&mut self, sentence: String) {
        self.number += 1;
        self.last = sentence;
    }

    fn report(&mut self, counts: &RefusedUnanswered) {
        let lost = self.lost.swap(0, Ordering::Relaxed);
        counts.lost_targets.fetch_add(lost, Ordering::Relaxed);
        if lost > 0 {
            tracing::warn!(lost, "joint targets over Zenoh arrive faster than they can be read");
        }
        let long = self.long.swap(0, Ordering::Relaxed);
        counts.targets.fetch_add(long + self.number, Ordering::Relaxed);
        if long > 0 {
            let limit = self.limit;
            tracing::warn!(
                refused = long,
                limit,
                "joint targets over Zenoh are longer than max_message_bytes"
            );
        }
        if self.number > 0 {
            tracing::warn!(refused = self.number, "joint targets over Zenoh are refused: {}", self.last);
            self.number = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(length: usize) -> ZBytes {
        vec![0; length].into()
    }

    fn counts(inbox: &Inbox) -> (u64, u64) {
        (inbox.lost.load(Ordering::Relaxed), inbox.long.load(Ordering::Relaxed))
    }

    #[test]
    fn waiting_targets_are_bounded_in_bytes_with_their_attachments() {
        let (inbox, mut receiver) = inbox(1000);
        for _ in 0..5 {
            inbox.take(&bytes(300), Some(&bytes(100)), || Proven::Nothing);
        }
        assert_eq!(counts(&inbox), (3, 0));
        let first = receiver.try_recv().unwrap();
        inbox.take(&bytes(300), Some(&bytes(100)), || Proven::Nothing);
        assert_eq!(counts(&inbox), (4, 0), "what is worked on counts too");
        drop(first);
        inbox.take(&bytes(300), Some(&bytes(100)), || Proven::Nothing);
        assert_eq!(counts(&inbox), (4, 0));
    }

    #[test]
    fn a_message_beyond_the_limit_of_messages_is_refused_unread() {
        let (inbox, mut receiver) = inbox(1000);
        inbox.take(&bytes(1001), None, || Proven::Nothing);
        inbox.take(&bytes(1000), Some(&bytes(1)), || Proven::Nothing);
        assert_eq!(counts(&inbox), (0, 2));
        assert!(receiver.try_recv().is_err());
        inbox.take(&bytes(1000), None, || Proven::Nothing);
        assert!(receiver.try_recv().is_ok());
    }

    #[test]
    fn waiting_targets_are_bounded_in_number() {
        let (inbox, receiver) = inbox(1000);
        for _ in 0..WAITING + 3 {
            inbox.take(&bytes(1), None, || Proven::Nothing);
        }
        assert_eq!(counts(&inbox), (3, 0));
        assert_eq!(receiver.len(), WAITING);
    }
}
