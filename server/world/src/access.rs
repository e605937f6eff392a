//! Access control: tokens of clients, and the role that each method requires.
//!
//! * Here: whether a call is allowed.
//! * `methods`: the role of each method, the objects that it concerns, and the claims that refuse it.
//! * `file`: the tokens in the operator's file.

mod file;
mod guesses;
mod methods;
#[cfg(test)]
mod tests;

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use prost_types::Timestamp;
use simd_proto::access::{Role, token_hash};
use tokio_util::sync::CancellationToken;

use self::file::TokenFile;
use self::guesses::Guesses;
pub use self::methods::{Claims, Concern, claims_of, concern_of, role_of};
use crate::account::Account;

/// Time between two checks of the file and of expired tokens.
const CHECK_INTERVAL: Duration = Duration::from_secs(1);

/// Maximum number of refusals logged per second; further ones are only counted, so that they cannot fill the
/// disk.
const REFUSALS: u32 = 10;

/// Whether clients need a token, and the valid tokens. Clones share them.
#[derive(Clone, Debug, Default)]
pub struct Access {
    /// File of tokens; `None` requires no tokens.
    file: Option<Arc<TokenFile>>,
    refusals: Arc<Mutex<Refusals>>,
    guesses: Arc<Guesses>,
}

/// Refusals of this second.
#[derive(Debug, Default)]
struct Refusals {
    second: i64,
    logged: u32,
    /// Refusals since the last logged one.
    unlogged: u64,
}

impl Refusals {
    fn may_log(&mut self, now: i64) -> Option<u64> {
        if self.second != now {
            (self.second, self.logged) = (now, 0);
        }
        if self.logged >= REFUSALS {
            self.unlogged += 1;
            return None;
        }
        self.logged += 1;
        Some(std::mem::take(&mut self.unlogged))
    }
}

/// Rights of a token.
#[derive(Debug)]
pub struct Grant {
    /// Name of the token.
    pub name: String,
    /// Role.
    pub role: Role,
    /// Robots that it may change; empty means all robots and the world.
    pub robots: Arc<[String]>,
    /// Time from which it is refused; `None` for never.
    pub expires: Option<Timestamp>,
    /// Cancelled when it is revoked or expires: its streams end then.
    pub revoked: CancellationToken,
}

impl Grant {
    /// # Errors
    /// Returns an error if its role is below `needed`, which `method` requires.
    pub fn check(&self, needed: Role, method: &str) -> Result<(), Denied> {
        if self.role >= needed {
            return Ok(());
        }
        let (name, method) = (self.name.clone(), method.to_owned());
        Err(Denied::Role { name, has: self.role, method, needed })
    }

    /// # Errors
    /// Returns an error if it is limited to some robots, and the method concerns more than robots.
    pub fn check_concern(&self, concern: Concern) -> Result<(), Denied> {
        let is_wider = matches!(concern, Concern::World | Concern::Pages);
        if self.robots.is_empty() || !is_wider {
            return Ok(());
        }
        Err(Denied::Robots { name: self.name.clone(), robots: self.robots.to_vec(), concern })
    }
}

/// Reason why a call is not allowed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Denied {
    /// The call has no token.
    #[error(
        "this daemon asks for a token: set SIMD_TOKEN; `simctl token add` makes one on the daemon's machine"
    )]
    Missing,
    /// The daemon does not know the token.
    #[error("the token is unknown, or was revoked")]
    Unknown,
    /// The token has expired.
    #[error("the token of {name} has expired")]
    Expired {
        /// Name of the token.
        name: String,
    },
    /// The token is limited to some robots.
    #[error(
        "the token is only for {}, and this call concerns {}", robots.join(", "),
        if *concern == Concern::World { "the whole world".to_owned() } else { concern.to_string() }
    )]
    Robots {
        /// Name of the token.
        name: String,
        /// Robots of the token.
        robots: Vec<String>,
        /// Objects that the method concerns.
        concern: Concern,
    },
    /// The role of the token is too low.
    #[error("the token of {name} has the role {has}, and {method} needs the role {needed}")]
    Role {
        /// Name of the token.
        name: String,
        /// Role of the token.
        has: Role,
        /// Called method.
        method: String,
        /// Role that the method requires.
        needed: Role,
    },
}

impl Denied {
    /// Returns the name of the token, if known.
    pub fn name(&self) -> &str {
        match self {
            Self::Missing | Self::Unknown => "",
            Self::Expired { name } | Self::Robots { name, .. } | Self::Role { name, .. } => name,
        }
    }
}

impl Access {
    /// Makes an access control without tokens.
    pub fn open() -> Self {
        Self::default()
    }

    /// Makes an access control with the tokens of a file.
    ///
    /// # Errors
    /// Returns a sentence if the file cannot be read, is not a file of tokens, or is readable by other users.
    pub fn from_file(path: PathBuf) -> Result<Self, String> {
        Ok(Self { file: Some(Arc::new(TokenFile::read(path)?)), ..Self::default() })
    }

    /// Returns whether clients need a token.
    pub fn is_required(&self) -> bool {
        self.file.is_some()
    }

    /// Returns the rights of a client's token; `None` if no tokens are required.
    ///
    /// # Errors
    /// Returns an error if it is missing, unknown or expired, or its role is below `needed`, which `method`
    /// requires.
    pub fn check(
        &self,
        token: Option<&str>,
        needed: Role,
        method: &str,
    ) -> Result<Option<Arc<Grant>>, Denied> {
        let Some(file) = &self.file else { return Ok(None) };
        let token = token.filter(|token| !token.is_empty()).ok_or(Denied::Missing)?;
        let hash = token_hash(token).ok_or(Denied::Unknown)?;
        let (entry, grant) = file.find(&hash).ok_or(Denied::Unknown)?;
        if entry.is_expired(now()) {
            return Err(Denied::Expired { name: entry.name.clone() });
        }
        grant.check(needed, method)?;
        Ok(Some(grant))
    }

    /// Returns how long a refusal has to wait: a sender of wrong tokens is slowed down.
    pub fn wait_before(&self, denied: &Denied, sender: &Account) -> Duration {
        match denied {
            Denied::Unknown => self.guesses.note(sender, Instant::now()),
            _ => Duration::ZERO,
        }
    }

    /// Number of wrong tokens since the start.
    pub fn wrong_tokens(&self) -> u64 {
        self.guesses.count()
    }

    /// Whether a refusal may have a line of the log, and how many before it had none.
    pub fn may_log_refusal(&self) -> Option<u64> {
        self.refusals.lock().unwrap_or_else(PoisonError::into_inner).may_log(now())
    }

    /// Checks the file for changes at intervals. Never returns.
    pub async fn keep_current(self) {
        let Some(file) = self.file else { return std::future::pending().await };
        let mut looks = tokio::time::interval(CHECK_INTERVAL);
        loop {
            looks.tick().await;
            let look = Arc::clone(&file);
            // A disk may be slow.
            let _ = tokio::task::spawn_blocking(move || look.refresh(now())).await;
        }
    }

    /// Checks the file at once.
    #[cfg(any(test, feature = "testing"))]
    pub fn look(&self) {
        if let Some(file) = &self.file {
            file.refresh(now());
        }
    }
}

/// Returns seconds since 1970.
fn now() -> i64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since.as_secs()).unwrap_or(i64::MAX)
}
