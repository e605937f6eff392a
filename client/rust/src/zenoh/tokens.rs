//! Liveliness tokens by which daemons know that this client is active, one for each daemon.

use std::collections::HashMap;
use std::fmt;
use std::sync::{Mutex, PoisonError};

use simd_proto::{SESSION_HEADER, keys};
use zenoh::liveliness::LivelinessToken;
use zenoh::{Session, Wait as _};

/// Tokens of one session; they end with it.
#[derive(Default)]
pub(super) struct Tokens(Mutex<HashMap<String, LivelinessToken>>);

impl Tokens {
    /// Declares the token for a daemon, unless it exists. Returns the line of an attachment that names it.
    pub(super) fn declare(&self, session: &Session, daemon: &str) -> Result<String, zenoh::Error> {
        let zid = session.zid().to_string();
        let mut tokens = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if !tokens.contains_key(daemon) {
            let token = session.liveliness().declare_token(keys::client(daemon, &zid)).wait()?;
            tokens.insert(daemon.to_owned(), token);
        }
        Ok(keys::attachment([(SESSION_HEADER, zid.as_str())]))
    }
}

impl fmt::Debug for Tokens {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Tokens")
    }
}
