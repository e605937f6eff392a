//! Results of the calls: acknowledged by kind, refused by reason, broken; and failures.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use simd_client::Error;
use tonic::Status;
use tonic_types::StatusExt as _;

use crate::statistics::percentile;

/// Counts, shared by all actors.
#[derive(Debug, Default)]
pub struct Tally(Mutex<Counts>);

#[derive(Debug, Default)]
struct Counts {
    acknowledged: BTreeMap<&'static str, u64>,
    refused: BTreeMap<String, u64>,
    /// Calls that got no answer, by their kind and the error.
    unanswered: BTreeMap<String, u64>,
    failures: Vec<String>,
    /// Milliseconds by transport, since they were last taken.
    ages: BTreeMap<&'static str, Vec<f64>>,
}

impl Tally {
    /// Counts the result of a call. Returns its answer if it was acknowledged.
    pub(super) fn note<T>(&self, kind: &'static str, result: Result<T, Error>) -> Option<T> {
        let mut counts = self.lock();
        match result {
            Ok(answer) => {
                *counts.acknowledged.entry(kind).or_default() += 1;
                Some(answer)
            }
            Err(Error::Refused(refusal)) => {
                let name = refusal.reason.as_str_name();
                let name = name.strip_prefix("ERROR_REASON_").unwrap_or(name);
                *counts.refused.entry(name.to_owned()).or_default() += 1;
                None
            }
            Err(error) => {
                *counts.unanswered.entry(format!("{kind}: {error}")).or_default() += 1;
                None
            }
        }
    }

    /// Like [`Self::note`], for tonic's result of a call.
    pub(super) fn note_status<T>(&self, kind: &'static str, result: Result<T, Status>) -> Option<T> {
        let status = match result {
            Ok(answer) => return self.note(kind, Ok(answer)),
            Err(status) => status,
        };
        let mut counts = self.lock();
        match status.get_details_error_info() {
            Some(info) => *counts.refused.entry(info.reason).or_default() += 1,
            None => *counts.unanswered.entry(format!("{kind}: {status}")).or_default() += 1,
        }
        None
    }

    /// Refusals that clients saw, by reason.
    pub fn refused(&self) -> BTreeMap<String, u64> {
        self.lock().refused.clone()
    }

    /// Number of calls without an answer.
    pub(super) fn unanswered(&self) -> u64 {
        self.lock().unanswered.values().sum()
    }

    /// Something that must never be: a lost command, a panic, the daemon's end.
    pub(super) fn fail(&self, what: String) {
        self.lock().failures.push(what);
    }

    /// How old a state was when it was read.
    pub(super) fn age(&self, transport: &'static str, age: Duration) {
        self.lock().ages.entry(transport).or_default().push(age.as_secs_f64() * 1e3);
    }

    /// Returns the median and the 99th percentile of the ages since the last call, milliseconds.
    pub(super) fn take_ages(&self) -> Vec<(&'static str, f64, f64)> {
        let mut ages = std::mem::take(&mut self.lock().ages);
        let spread = |(transport, ages): (&&'static str, &mut Vec<f64>)| {
            ages.sort_by(f64::total_cmp);
            (*transport, percentile(ages, 0.5), percentile(ages, 0.99))
        };
        ages.iter_mut().map(spread).collect()
    }

    /// Calls that were acknowledged, and calls that were refused.
    pub fn totals(&self) -> (u64, u64) {
        let counts = self.lock();
        (counts.acknowledged.values().sum(), counts.refused.values().sum())
    }

    /// Calls of a kind that were acknowledged.
    pub fn acknowledged(&self, kind: &str) -> u64 {
        self.lock().acknowledged.get(kind).copied().unwrap_or_default()
    }

    /// Returns the results that must never occur.
    pub fn failures(&self) -> Vec<String> {
        self.lock().failures.clone()
    }

    fn lock(&self) -> MutexGuard<'_, Counts> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counts = self.lock();
        writeln!(f, "acknowledged")?;
        for (kind, count) in &counts.acknowledged {
            writeln!(f, "  {count:9}  {kind}")?;
        }
        writeln!(f, "without an answer")?;
        for (what, count) in &counts.unanswered {
            writeln!(f, "  {count:9}  {what}")?;
        }
        writeln!(f, "failures: {}", counts.failures.len())?;
        counts.failures.iter().try_for_each(|failure| writeln!(f, "  {failure}"))
    }
}
