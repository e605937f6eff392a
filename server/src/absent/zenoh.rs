//! Takes the place of the Zenoh front-end in a build without the feature `zenoh`.

use simd_world::SimHandle;

use crate::config;

/// This build has no Zenoh.
#[derive(Debug, thiserror::Error)]
#[error("{}", config::NO_ZENOH)]
pub struct Error;

impl Error {
    /// Returns the exit code of the process.
    pub fn exit_code(&self) -> u8 {
        3
    }
}

/// A session, of which there is none.
#[derive(Debug)]
pub enum Opened {}

/// The front-end while it serves, which it never does.
#[derive(Debug)]
pub enum Serving {}

/// The number of replies, of which there are none.
#[derive(Clone, Copy, Debug)]
pub enum Replies {}

/// Refuses to open a session.
///
/// # Errors
/// Returns that this build has no Zenoh.
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
