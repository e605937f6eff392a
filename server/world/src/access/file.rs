//! The tokens in the operator's file, which is read again when it changes.

use std::collections::BTreeMap;
use std::fs::{self, Metadata};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::SystemTime;

use arc_swap::ArcSwap;
use simd_assets::files;
use simd_proto::access::{TokenEntry, parse_tokens};
use tokio_util::sync::CancellationToken;

use super::Grant;

/// Maximum size of the file, bytes.
const MAX_BYTES: u64 = 1 << 20;

/// Hash of a token.
type Hash = [u8; 32];

/// Entries by hash, each with its rights.
type Table = BTreeMap<Hash, (TokenEntry, Arc<Grant>)>;

/// Time and size of the file, which show a change.
type Version = (Option<SystemTime>, u64);

#[derive(Debug)]
pub(super) struct TokenFile {
    path: PathBuf,
    table: ArcSwap<Table>,
    /// Version of the file that was read last, and its fault.
    read: Mutex<(Version, Option<String>)>,
}

impl TokenFile {
    pub(super) fn read(path: PathBuf) -> Result<Self, String> {
        let (entries, version) = entries(&path)?;
        let table = ArcSwap::from_pointee(table(entries, &Table::new()));
        Ok(Self { path, table, read: Mutex::new((version, None)) })
    }

    /// Finds a token by its hash. The time of the search reveals nothing about a token, since a caller cannot
    /// choose its hash.
    pub(super) fn find(&self, hash: &Hash) -> Option<(TokenEntry, Arc<Grant>)> {
        self.table.load().get(hash).cloned()
    }

    /// Reads the file again if it has changed, and revokes removed or expired tokens. A file that is
    /// unreadable or invalid changes nothing, and is logged once.
    pub(super) fn refresh(&self, now: i64) {
        let mut read = self.read.lock().unwrap_or_else(PoisonError::into_inner);
        let version = fs::metadata(&self.path).as_ref().map(version).unwrap_or_default();
        if version != read.0 {
            match entries(&self.path) {
                Ok((entries, version)) => {
                    let before = self.table.load();
                    let after = table(entries, &before);
                    let (count, path) = (after.len(), self.path.display().to_string());
                    let is_kept = |hash: &Hash, grant: &Arc<Grant>| {
                        after.get(hash).is_some_and(|(_, now)| Arc::ptr_eq(now, grant))
                    };
                    let gone: Vec<_> = before
                        .iter()
                        .filter(|(hash, (_, grant))| !is_kept(hash, grant))
                        .map(|(_, (_, grant))| Arc::clone(grant))
                        .collect();
                    self.table.store(Arc::new(after));
                    gone.iter().for_each(|grant| grant.revoked.cancel());
                    tracing::info!(path, count, "the file of tokens was read again");
                    *read = (version, None);
                }
                Err(sentence) if read.1.as_ref() != Some(&sentence) => {
                    tracing::error!("the tokens are unchanged: {sentence}");
                    read.1 = Some(sentence);
                }
                Err(_known) => {}
            }
        }
        let table = self.table.load();
        let expired = table.values().filter(|(entry, _)| entry.is_expired(now));
        expired.for_each(|(_, grant)| grant.revoked.cancel());
    }
}

/// Makes the table; unchanged entries keep their grants.
fn table(entries: Vec<TokenEntry>, before: &Table) -> Table {
    let granted = |entry: TokenEntry| {
        let known = before.get(&entry.hash).filter(|(known, _)| *known == entry);
        let grant = known.map(|(_, grant)| Arc::clone(grant)).unwrap_or_else(|| {
            let revoked = CancellationToken::new();
            let (name, role, expires) = (entry.name.clone(), entry.role, entry.expires);
            Arc::new(Grant { name, role, expires, robots: entry.robots.clone().into(), revoked })
        });
        (entry.hash, (entry, grant))
    };
    entries.into_iter().map(granted).collect()
}

fn entries(path: &Path) -> Result<(Vec<TokenEntry>, Version), String> {
    let of_file = |sentence: String| format!("the file of tokens {}: {sentence}", path.display());
    let unreadable = |error: std::io::Error| of_file(format!("it cannot be read: {error}"));
    let file = files::open(path).map_err(unreadable)?;
    let metadata = file.metadata().map_err(unreadable)?;
    check_mode(&metadata).map_err(of_file)?;
    // A disk was full, or the file is about to be written: `simctl` writes a heading, also without tokens.
    if metadata.len() == 0 {
        return Err(of_file("it is empty; `simctl token add` writes one".to_owned()));
    }
    let bytes = files::read(file, MAX_BYTES).map_err(unreadable)?;
    let text = String::from_utf8(bytes).map_err(|_| of_file("it is not text".to_owned()))?;
    Ok((parse_tokens(&text).map_err(of_file)?, version(&metadata)))
}

/// Checks that other users can neither add tokens nor read them.
#[cfg(unix)]
fn check_mode(metadata: &Metadata) -> Result<(), String> {
    use std::os::unix::fs::PermissionsExt as _;
    let mode = metadata.permissions().mode() & 0o777;
    if mode & 0o077 == 0 {
        return Ok(());
    }
    Err(format!("others can read or change it (its mode is {mode:o}): chmod 600"))
}

#[cfg(not(unix))]
fn check_mode(_metadata: &Metadata) -> Result<(), String> {
    Ok(())
}

fn version(metadata: &Metadata) -> Version {
    (metadata.modified().ok(), metadata.len())
}
