//! Uploads that are not complete yet: bounded in number and bytes, and forgotten
//! when nothing more comes. Owns no clock: it is given the time.

use std::collections::HashMap;
use std::time::Duration;

use simd_model::robot::Sha256;
use tokio::time::Instant;

use crate::account::Account;
use crate::call_error::CallError;
use crate::info::DaemonLimits;

/// Files of which a part has come.
#[derive(Debug)]
pub(super) struct Partials {
    by_hash: HashMap<Sha256, Partial>,
    /// Uploads under way at one time, and of one client.
    count: usize,
    count_of_client: usize,
    /// Bytes of all of them; at least those of the largest file, so that one always fits.
    bytes: usize,
    /// An upload is abandoned when nothing came for so long.
    abandoned: Duration,
}

#[derive(Debug)]
struct Partial {
    /// Who sends it.
    account: Account,
    total: u64,
    bytes: Vec<u8>,
    touched: Instant,
}

/// How far an upload is.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Progress {
    /// So many bytes are here.
    Received(u64),
    /// All of it; whether it has the hash is not checked yet.
    Complete(Vec<u8>),
}

impl Partials {
    pub(super) fn new(limits: &DaemonLimits) -> Self {
        Self {
            by_hash: HashMap::new(),
            count: limits.uploads.max(1),
            count_of_client: limits.uploads_of_client.max(1),
            bytes: limits.partial_upload_bytes.max(usize::try_from(limits.asset_bytes).unwrap_or(usize::MAX)),
            abandoned: limits.abandoned_upload,
        }
    }

    /// Adds a part. Part 0 begins anew unless it is what is here already; a later
    /// part must begin where the last ended, or repeat what is here.
    ///
    /// # Errors
    /// Returns an error if the part does not fit to those before. What was here stays.
    pub(super) fn append(
        &mut self,
        sha256: Sha256,
        total: u64,
        offset: u64,
        data: &[u8],
        now: Instant,
    ) -> Result<Progress, CallError> {
        self.forget_abandoned(now);
        if offset.checked_add(data.len() as u64).is_none_or(|end| end > total) {
            return Err(mismatch(format!(
                "the part of {} bytes at {offset} goes beyond the file's {total} bytes",
                data.len()
            )));
        }
        if offset > 0 {
            self.check_continues(&sha256, total, offset)?;
        }
        if !self.by_hash.contains_key(&sha256) {
            let account = Account::current();
            if account != Account::Process {
                self.make_room(self.count_of_client - 1, usize::MAX, |_, partial| partial.account == account);
            }
            self.make_room(self.count - 1, usize::MAX, |_, _| true);
        }
        let partial = self.by_hash.entry(sha256).or_insert_with(|| Partial {
            account: Account::current(),
            total,
            bytes: Vec::new(),
            touched: now,
        });
        partial.touched = now;
        // Fits: it is not beyond what is here.
        let start = offset as usize;
        let there = partial.bytes.get(start..).unwrap_or_default();
        let repeated = there.len().min(data.len());
        if partial.total != total || there.get(..repeated) != data.get(..repeated) {
            if offset > 0 {
                return Err(mismatch(format!("the part at {offset} is not what was sent before")));
            }
            (partial.total, partial.bytes) = (total, data.to_vec());
        } else {
            partial.bytes.extend_from_slice(data.get(repeated..).unwrap_or_default());
        }
        let received = partial.bytes.len() as u64;
        if received == total {
            let complete = self.by_hash.remove(&sha256).map(|partial| partial.bytes);
            return Ok(Progress::Complete(complete.unwrap_or_default()));
        }
        self.make_room(self.count, self.bytes, |other, _| *other != sha256);
        Ok(Progress::Received(received))
    }

    /// Forgets uploads for which nothing came for long.
    pub(super) fn forget_abandoned(&mut self, now: Instant) {
        self.by_hash.retain(|_, partial| now.saturating_duration_since(partial.touched) < self.abandoned);
    }

    /// How many there are, and the bytes of them that have come.
    pub(super) fn under_way(&self) -> (usize, usize) {
        (self.by_hash.len(), self.by_hash.values().map(|partial| partial.bytes.len()).sum())
    }

    /// Bytes of all of them, in memory.
    #[cfg(test)]
    pub(super) fn bytes(&self) -> usize {
        self.by_hash.values().map(|partial| partial.bytes.capacity()).sum()
    }

    fn check_continues(&self, sha256: &Sha256, total: u64, offset: u64) -> Result<(), CallError> {
        let Some(partial) = self.by_hash.get(sha256) else {
            return Err(mismatch(format!(
                "the part at {offset} continues an upload that is not under way (abandoned ones are \
                 forgotten); begin anew at 0"
            )));
        };
        if partial.total != total {
            return Err(mismatch(format!("the file's size was {} bytes and is {total} now", partial.total)));
        }
        if offset > partial.bytes.len() as u64 {
            return Err(mismatch(format!(
                "the part begins at {offset}, and only {} bytes are here",
                partial.bytes.len()
            )));
        }
        Ok(())
    }

    /// Forgets some of these uploads, the longest untouched first, until there are at most so many of them, and all
    /// have so many bytes.
    fn make_room(&mut self, count: usize, bytes: usize, of: impl Fn(&Sha256, &Partial) -> bool) {
        loop {
            let (_, held) = self.under_way();
            let some = || self.by_hash.iter().filter(|(sha256, partial)| of(sha256, partial));
            if some().count() <= count && held <= bytes {
                return;
            }
            let Some(oldest) = some().min_by_key(|(_, partial)| partial.touched).map(|(sha256, _)| *sha256)
            else {
                return;
            };
            self.by_hash.remove(&oldest);
        }
    }
}

fn mismatch(message: String) -> CallError {
    CallError::UploadMismatch { message }
}

#[cfg(test)]
mod tests;
