//! Who may call what: tokens that clients present, and the role that each method asks for.
//!
//! * Here: whether a call is allowed.
//! * `methods`: the role of each method, and what it concerns.
//! * `file`: the tokens as the operator's file has them.

mod file;
mod methods;
#[cfg(test)]
mod tests;

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use prost_types::Timestamp;
use simd_proto::access::{Role, token_hash};
use tokio_util::sync::CancellationToken;

use self::file::TokenFile;
pub use self::methods::{Concern, concern_of, role_of};

/// How often the file is looked at, and tokens that expired are revoked.
const LOOK: Duration = Duration::from_secs(1);

/// Refusals that are logged a second; the others are counted, so that a flood of them does not fill the disk.
const REFUSALS: u32 = 10;

/// Whether clients need a token, and which there are. Clones are the same.
#[derive(Clone, Debug, Default)]
pub struct Access {
    /// `None`: no tokens are asked for.
    file: Option<Arc<TokenFile>>,
    refusals: Arc<Mutex<Refusals>>,
}

/// Refusals of this second.
#[derive(Debug, Default)]
struct Refusals {
    second: i64,
    logged: u32,
    /// Since the last that was logged.
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

/// What a token allows.
#[derive(Debug)]
pub struct Grant {
    /// Whose it is.
    pub name: String,
    /// What it allows.
    pub role: Role,
    /// The robots that it may change; none is all, and the world.
    pub robots: Arc<[String]>,
    /// It is refused from then on; `None` is never.
    pub expires: Option<Timestamp>,
    /// Set once it was revoked or has expired: streams that it began end then.
    pub revoked: CancellationToken,
}

impl Grant {
    /// # Errors
    /// Returns an error if it allows less than `needed`, which `method` needs.
    pub fn check(&self, needed: Role, method: &str) -> Result<(), Denied> {
        if self.role >= needed {
            return Ok(());
        }
        let (name, method) = (self.name.clone(), method.to_owned());
        Err(Denied::Role { name, has: self.role, method, needed })
    }

    /// # Errors
    /// Returns an error if it is for some robots alone, and the method concerns more than robots.
    pub fn check_concern(&self, concern: Concern) -> Result<(), Denied> {
        let is_wider = matches!(concern, Concern::World | Concern::Pages);
        if self.robots.is_empty() || !is_wider {
            return Ok(());
        }
        Err(Denied::Robots { name: self.name.clone(), robots: self.robots.to_vec(), concern })
    }
}

/// Why a call is not allowed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Denied {
    /// There is no token.
    #[error(
        "this daemon asks for a token: set SIMD_TOKEN; `simctl token add` makes one where the daemon runs"
    )]
    Missing,
    /// It is none of the daemon's.
    #[error("the token is unknown, or was revoked")]
    Unknown,
    /// Its time is over.
    #[error("the token of {name} has expired")]
    Expired {
        /// Whose it is.
        name: String,
    },
    /// It is for some robots alone.
    #[error(
        "the token is for {} alone, and this concerns {}", robots.join(", "),
        if *concern == Concern::World { "the whole world".to_owned() } else { concern.to_string() }
    )]
    Robots {
        /// Whose it is.
        name: String,
        /// Those that it is for.
        robots: Vec<String>,
        /// What the method concerns.
        concern: Concern,
    },
    /// It allows less.
    #[error("the token of {name} is that of {a} {has}, and {method} needs {an} {needed}", a = article(*has), an = article(*needed))]
    Role {
        /// Whose it is.
        name: String,
        /// What it allows.
        has: Role,
        /// What is called.
        method: String,
        /// What that needs.
        needed: Role,
    },
}

fn article(role: Role) -> &'static str {
    match role {
        Role::Viewer => "a",
        Role::Operator | Role::Admin => "an",
    }
}

impl Denied {
    /// Whose token it was, where that is known.
    pub fn name(&self) -> &str {
        match self {
            Self::Missing | Self::Unknown => "",
            Self::Expired { name } | Self::Robots { name, .. } | Self::Role { name, .. } => name,
        }
    }
}

impl Access {
    /// No client needs a token.
    pub fn open() -> Self {
        Self::default()
    }

    /// By the tokens of a file.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read, is no file of tokens, or can be read by others; a sentence.
    pub fn from_file(path: PathBuf) -> Result<Self, String> {
        Ok(Self { file: Some(Arc::new(TokenFile::read(path)?)), ..Self::default() })
    }

    /// Whether clients need a token.
    pub fn is_required(&self) -> bool {
        self.file.is_some()
    }

    /// What the token allows that a client presents; `None` where none is needed.
    ///
    /// # Errors
    /// Returns an error if it is missing, unknown or expired, and where it allows less than `needed`, which `method` needs.
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

    /// Whether a refusal may have a line of the log, and how many before it had none.
    pub fn may_log_refusal(&self) -> Option<u64> {
        self.refusals.lock().unwrap_or_else(PoisonError::into_inner).may_log(now())
    }

    /// Looks now and then whether the file has changed. Never returns.
    pub async fn keep_current(self) {
        let Some(file) = self.file else { return std::future::pending().await };
        let mut looks = tokio::time::interval(LOOK);
        loop {
            looks.tick().await;
            let look = Arc::clone(&file);
            // A disk may be slow.
            let _ = tokio::task::spawn_blocking(move || look.refresh(now())).await;
        }
    }

    /// Looks at once.
    #[cfg(any(test, feature = "testing"))]
    pub fn look(&self) {
        if let Some(file) = &self.file {
            file.refresh(now());
        }
    }
}

/// Seconds since 1970.
fn now() -> i64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since.as_secs()).unwrap_or(i64::MAX)
}
