//! Joint targets that come as publications: taken in the order in which they come,
//! without an answer. Refusals are counted, and logged once a second at the most.
//!
//! Bounded: what comes while [`WAITING`] messages wait is lost and counted, since the
//! next one is newer anyway.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use futures_util::StreamExt as _;
use prost::Message as _;
use simd_core::Command;
use simd_proto::{CLIENT_HEADER, keys, v1};
use tokio::sync::mpsc;
use tokio::time::{Interval, MissedTickBehavior, interval};
use tokio_stream::wrappers::ReceiverStream;
use tokio_util::sync::CancellationToken;
use zenoh::Session;
use zenoh::bytes::ZBytes;

use super::Error;
use crate::SimHandle;
use crate::convert::from_proto::joint::set_joint_targets;
use crate::handle::{Aim, Caller, Transport};

/// Messages that wait to be read.
const WAITING: usize = 256;
/// Commands that wait for their step.
const UNDER_WAY: usize = 64;
/// How often refusals are logged.
const REPORT: Duration = Duration::from_secs(1);

/// Targets, and what goes with them.
type Sent = (ZBytes, Option<ZBytes>);

/// Takes targets from now on.
pub(super) async fn serve(
    session: &Session,
    name: &str,
    handle: &SimHandle,
    ended: &CancellationToken,
) -> Result<(), Error> {
    let (sender, receiver) = mpsc::channel(WAITING);
    let lost = Arc::new(AtomicU64::new(0));
    let counted = lost.clone();
    let subscriber = session.declare_subscriber(keys::joint_targets(name)).callback(move |sample| {
        let waiting = (sample.payload().clone(), sample.attachment().cloned());
        if sender.try_send(waiting).is_err() {
            counted.fetch_add(1, Ordering::Relaxed);
        }
    });
    subscriber.background().await.map_err(Error::session)?;
    tokio::spawn(ended.clone().run_until_cancelled_owned(take(handle.clone(), receiver, lost)));
    Ok(())
}

async fn take(handle: SimHandle, receiver: mpsc::Receiver<Sent>, lost: Arc<AtomicU64>) {
    let mut refusals = Refusals::new(lost);
    // Polled in the order in which they came, so that they enter the mailbox in that order.
    let mut results = ReceiverStream::new(receiver).map(|sent| set(&handle, sent)).buffered(UNDER_WAY);
    loop {
        tokio::select! {
            result = results.next() => match result {
                Some(Ok(())) => {}
                Some(Err(sentence)) => refusals.count(sentence),
                None => return,
            },
            _tick = refusals.ticks.tick() => refusals.report(),
        }
    }
}

async fn set(handle: &SimHandle, (payload, attachment): Sent) -> Result<(), String> {
    let request = v1::SetJointTargetsRequest::decode(&*payload.to_bytes())
        .map_err(|error| format!("the payload is no SetJointTargetsRequest: {error}"))?;
    let targets = set_joint_targets(request).map_err(|error| error.to_string())?;
    let aim = Aim::of(&targets);
    handle.command(Command::SetTargets(targets)).await.map_err(|error| error.to_string())?;
    let caller = attachment.and_then(|attachment| caller(&attachment.to_bytes()));
    if let Some(caller) = &caller {
        // It is here, though nobody answers it.
        drop(handle.begin_call(caller.clone()));
    }
    handle.note_targets(caller.as_ref(), aim);
    Ok(())
}

/// Who publishes, by the attachment.
fn caller(attachment: &[u8]) -> Option<Caller> {
    let text = String::from_utf8_lossy(attachment);
    Caller::said(keys::parse_attachment(&text, CLIENT_HEADER)?, Transport::Zenoh)
}

/// What was refused since it was last logged.
struct Refusals {
    number: u64,
    /// Why the last of them was.
    last: String,
    lost: Arc<AtomicU64>,
    ticks: Interval,
}

impl Refusals {
    fn new(lost: Arc<AtomicU64>) -> Self {
        let mut ticks = interval(REPORT);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        Self { number: 0, last: String::new(), lost, ticks }
    }

    fn count(&mut self, sentence: String) {
        self.number += 1;
        self.last = sentence;
    }

    fn report(&mut self) {
        let lost = self.lost.swap(0, Ordering::Relaxed);
        if lost > 0 {
            tracing::warn!(lost, "joint targets come over Zenoh faster than they can be read");
        }
        if self.number > 0 {
            tracing::warn!(refused = self.number, "joint targets over Zenoh are refused: {}", self.last);
            self.number = 0;
        }
    }
}
