//! Incomplete uploads: bounded in number and bytes, and forgotten when no part arrives for long. It owns no
//! clock: the caller passes the time.

use std::collections::HashMap;
use std::time::Duration;

use simd_model::robot::Sha256;
use tokio::time::Instant;

use super::source::FilePart;
use crate::account::Account;
use crate::call_error::CallError;
use crate::info::DaemonLimits;

/// Partly received files.
#[derive(Debug)]
pub(super) struct Partials {
    by_hash: HashMap<Sha256, Partial>,
    /// Maximum number of uploads in progress, in total and of one client.
    count: usize,
    count_of_client: usize,
    /// Maximum bytes of all uploads; at least those of the largest file, so that one always fits.
    bytes: usize,
    /// Time without a part after which an upload is abandoned.
    abandoned: Duration,
}

#[derive(Debug)]
struct Partial {
    /// Client that sends it.
    account: Account,
    total: u64,
    bytes: Vec<u8>,
    touched: Instant,
}

/// Progress of an upload.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Progress {
    /// Number of received bytes.
    Received(u64),
    /// All bytes; their hash is still to be checked.
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

    /// Adds a part. Part 0 restarts the upload unless it repeats the received bytes. A later part must begin
    /// at the end of the last one, or repeat received bytes.
    ///
    /// # Errors
    /// Returns an error if the part does not match the earlier ones, which stay.
    pub(super) fn append(
        &mut self,
        account: &Account,
        part: &FilePart,
        now: Instant,
    ) -> Result<Progress, CallError> {
        let FilePart { sha256, total, offset, data } = part;
        let (sha256, total, offset) = (*sha256, *total, *offset);
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
            if *account != Account::Process {
                self.make_room(self.count_of_client - 1, usize::MAX, |_, partial| {
                    partial.account == *account
                });
            }
            self.make_room(self.count - 1, usize::MAX, |_, _| true);
        }
        let partial = self.by_hash.entry(sha256).or_insert_with(|| Partial {
            account: account.clone(),
            total,
            bytes: Vec::new(),
            touched: now,
        });
        partial.touched = now;
        // No truncation: it is not beyond the received bytes.
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

    /// Forgets uploads without a new part for long.
    pub(super) fn forget_abandoned(&mut self, now: Instant) {
        self.by_hash.retain(|_, partial| now.saturating_duration_since(partial.touched) < self.abandoned);
    }

    /// Returns the number of uploads, and their received bytes.
    pub(super) fn under_way(&self) -> (usize, usize) {
        (self.by_hash.len(), self.by_hash.values().map(|partial| partial.bytes.len()).sum())
    }

    /// Returns the memory of all uploads, bytes.
    #[cfg(test)]
    pub(super) fn bytes(&self) -> usize {
        self.by_hash.values().map(|partial| partial.bytes.capacity()).sum()
    }

    fn check_continues(&self, sha256: &Sha256, total: u64, offset: u64) -> Result<(), CallError> {
        let Some(partial) = self.by_hash.get(sha256) else {
            return Err(mismatch(format!(
                "the part at {offset} continues an upload that is not in progress (abandoned uploads are \
                 forgotten); start again at 0"
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

    /// Forgets some of these uploads, the longest untouched first, until at most `count` of them remain, and
    /// all uploads have at most `bytes`.
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
