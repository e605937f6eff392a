//! Replaces the Zenoh front-end in a build without the feature `zenoh`.

use simd_world::SimHandle;

use crate::config;

/// Error: this build has no Zenoh.
#[derive(Debug, thiserror::Error)]
#[error("{}", config::NO_ZENOH)]
pub struct Error;

impl Error {
    /// Returns the exit code of the process.
    pub fn exit_code(&self) -> u8 {
        3
    }
}

/// A session, which never exists.
#[derive(Debug)]
pub enum Opened {}

/// The running front-end, which never exists.
#[derive(Debug)]
pub enum Serving {}

/// Numbers of replies, which never exist.
#[derive(Clone, Copy, Debug)]
pub enum Replies {}

/// Refuses to open a session.
///
/// # Errors
/// Always returns that this build has no Zenoh.
pub async fn open(_settings: &config::Zenoh, _name: &str) -> Result<Opened, Error> {
    Err(Error)
}

impl Opened {
    /// Never called.
    ///
    /// # Errors
    /// None.
    pub async fn serve(self, _handle: &SimHandle) -> Result<Serving, Error> {
        match self {}
    }
}

impl Serving {
    /// Never called.
    pub fn locators(&self) -> &[String] {
        match *self {}
    }

    /// Never called.
    pub fn replies(&self) -> Replies {
        match *self {}
    }

    /// Never called.
    pub async fn drain(self) {
        match self {}
    }
}
