//! Why a daemon does not start, or ends by itself.

use std::path::PathBuf;

use crate::zenoh;
use simd_world::handle::CallError;

/// Why a daemon does not start, or ends by itself.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// An asset root is not a folder that can be read.
    #[error("asset root {folder}: {source}", folder = folder.display())]
    AssetRoot {
        /// As the operator wrote it.
        folder: PathBuf,
        /// The system's words.
        source: std::io::Error,
    },
    /// The address or the socket cannot be listened on.
    #[error("cannot listen on {address}: {source}")]
    Listen {
        /// As the operator wrote it.
        address: String,
        /// The system's words.
        source: std::io::Error,
    },
    /// The files of TLS or of tokens cannot be used.
    #[error("{0}")]
    Security(String),
    /// Zenoh cannot be served.
    #[error(transparent)]
    Zenoh(#[from] zenoh::Error),
    /// A robot cannot be loaded.
    #[error("cannot load {path}: {source}", path = path.display())]
    Robot {
        /// As the operator wrote it.
        path: PathBuf,
        /// Why.
        source: CallError,
    },
    /// The system gives no threads or no signals.
    #[error("cannot start: {0}")]
    System(std::io::Error),
    /// The driver failed.
    #[error("the physics thread ended: {0}")]
    Driver(String),
    /// The server failed.
    #[error("the server ended: {0}")]
    Server(String),
    /// A second signal came while it drained.
    #[error("cut off by a second signal")]
    CutOff,
}

impl Error {
    /// The process's exit code, as `simd --help` has it.
    pub fn exit_code(&self) -> u8 {
        match self {
            // An asset root was there when the configuration was read.
            Self::AssetRoot { .. } | Self::System(_) | Self::Driver(_) | Self::Server(_) | Self::CutOff => 1,
            Self::Listen { .. } => 4,
            Self::Robot { .. } => 5,
            Self::Security(_) => 3,
            Self::Zenoh(error) => error.exit_code(),
        }
    }
}
