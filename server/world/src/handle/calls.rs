//! Numbers of calls, their outcomes and durations, for operators.

use std::collections::BTreeMap;
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use simd_proto::methods::Method;

use super::{SimHandle, Transport};
use crate::histogram::{Counts, Histogram};

/// All calls so far. Bounded by the schema's methods, codes and reasons.
#[derive(Debug, Default)]
pub(super) struct CallCounts {
    calls: Mutex<BTreeMap<(&'static str, Transport), Calls>>,
    refused: Arc<RefusedUnanswered>,
}

/// Refusals that have no answer.
#[derive(Debug, Default)]
pub struct RefusedUnanswered {
    /// Connections that were refused because of their number.
    pub connections: AtomicU64,
    /// Published targets that were not allowed or not possible.
    pub targets: AtomicU64,
    /// Published targets that arrived faster than they could be read.
    pub lost_targets: AtomicU64,
}

/// Calls of one method over one transport.
#[derive(Debug, Default)]
struct Calls {
    /// Numbers of ended calls by gRPC code and reason; no reason is empty.
    ended: BTreeMap<(i32, &'static str), u64>,
    duration: Histogram,
    /// Number of open streams.
    streams: u64,
}

/// Calls of one method over one transport, at a moment.
#[derive(Clone, Debug)]
pub struct MethodCalls {
    /// `SERVICE/METHOD`.
    pub method: &'static str,
    /// Transport of the calls.
    pub transport: Transport,
    /// Numbers of ended calls by gRPC code and reason; no reason is empty.
    pub ended: Vec<((i32, &'static str), u64)>,
    /// Time until the answer, or until the first of a stream.
    pub duration: Counts,
    /// Number of open streams.
    pub streams: u64,
}

/// An open stream, counted until this is dropped.
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

/// Returns the name in metrics.
fn name(method: &'static Method) -> &'static str {
    method.path.strip_prefix("/simd.v1.").unwrap_or(&method.path)
}

impl SimHandle {
    /// Counts an answered call by its gRPC code and, if it was refused, its reason.
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

    /// Counts a refusal that is not the status of a call. Examples are a refused request of a stream that
    /// continues, or a query that found no room.
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

    /// Returns the counters of refusals that have no answer.
    pub fn refused_unanswered(&self) -> Arc<RefusedUnanswered> {
        Arc::clone(&self.inner.calls.refused)
    }

    /// Counts a stream that begins.
    pub fn stream_begins(&self, method: &'static Method, transport: Transport) -> OpenStream {
        let key = (name(method), transport);
        self.inner.calls.lock().entry(key).or_default().streams += 1;
        OpenStream { handle: self.clone(), key }
    }

    /// Returns all calls so far, by method and transport.
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
