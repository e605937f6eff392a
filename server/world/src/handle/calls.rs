//! How many calls there were, how they ended and how long they took: for operators to see.

use std::collections::BTreeMap;
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use simd_proto::methods::Method;

use super::{SimHandle, Transport};
use crate::histogram::{Counts, Histogram};

/// All calls so far. Bounded by what the schema has: methods, codes and reasons.
#[derive(Debug, Default)]
pub(super) struct CallCounts {
    calls: Mutex<BTreeMap<(&'static str, Transport), Calls>>,
    refused: Arc<RefusedUnanswered>,
}

/// What was refused without an answer that says why.
#[derive(Debug, Default)]
pub struct RefusedUnanswered {
    /// There was no room for them.
    pub connections: AtomicU64,
    /// That were published, and not allowed or not possible.
    pub targets: AtomicU64,
    /// That were published faster than they can be read.
    pub lost_targets: AtomicU64,
}

/// Of one method by one transport.
#[derive(Debug, Default)]
struct Calls {
    /// By gRPC code and reason, which is empty where there is none.
    ended: BTreeMap<(i32, &'static str), u64>,
    duration: Histogram,
    /// Streams that go on.
    streams: u64,
}

/// Of one method by one transport, at a moment.
#[derive(Clone, Debug)]
pub struct MethodCalls {
    /// `SERVICE/METHOD`.
    pub method: &'static str,
    /// The transport of the calls.
    pub transport: Transport,
    /// By gRPC code and reason, which is empty where there is none.
    pub ended: Vec<((i32, &'static str), u64)>,
    /// Until the answer, or the first of a stream.
    pub duration: Counts,
    /// Streams that go on.
    pub streams: u64,
}

/// A stream that is counted as long as this is kept.
#[derive(Debug)]
pub struct OpenStream {
    handle: SimHandle,
    key: (&'static str, Transport),
}

impl Drop for OpenStream {
    fn drop(&mut self) {
        if let Some(calls) = self.handle.inner.calls.lock().get_mut(&self.key) {
            calls.streams = calls.streams.saturating_sub(1);
        }
    }
}

impl CallCounts {
    fn lock(&self) -> MutexGuard<'_, BTreeMap<(&'static str, Transport), Calls>> {
        self.calls.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// As metrics name it.
fn name(method: &'static Method) -> &'static str {
    method.path.strip_prefix("/simd.v1.").unwrap_or(&method.path)
}

impl SimHandle {
    /// A call was answered: with a gRPC code, and a reason where it was refused.
    pub fn call_ended(
        &self,
        method: &'static Method,
        transport: Transport,
        (code, reason): (i32, &'static str),
        duration: Duration,
    ) {
        let mut calls = self.inner.calls.lock();
        let calls = calls.entry((name(method), transport)).or_default();
        *calls.ended.entry((code, reason)).or_default() += 1;
        calls.duration.observe(duration);
    }

    /// Something was refused that is not answered by the status of a call: a request of a stream that goes on, or a
    /// query that found no room.
    pub fn refused_beside_calls(
        &self,
        method: &'static Method,
        transport: Transport,
        how: (i32, &'static str),
    ) {
        let mut calls = self.inner.calls.lock();
        let calls = calls.entry((name(method), transport)).or_default();
        *calls.ended.entry(how).or_default() += 1;
    }

    /// Where refusals are counted that have no answer.
    pub fn refused_unanswered(&self) -> Arc<RefusedUnanswered> {
        Arc::clone(&self.inner.calls.refused)
    }

    /// A stream begins.
    pub fn stream_begins(&self, method: &'static Method, transport: Transport) -> OpenStream {
        let key = (name(method), transport);
        self.inner.calls.lock().entry(key).or_default().streams += 1;
        OpenStream { handle: self.clone(), key }
    }

    /// All calls so far, by method and transport.
    pub fn call_counts(&self) -> Vec<MethodCalls> {
        let calls = self.inner.calls.lock();
        let of = |(&(method, transport), calls): (&(&'static str, Transport), &Calls)| MethodCalls {
            method,
            transport,
            ended: calls.ended.iter().map(|(how, count)| (*how, *count)).collect(),
            duration: calls.duration.counts(),
            streams: calls.streams,
        };
        calls.iter().map(of).collect()
    }
}
