//! Errors of a daemon's start, and causes of its unexpected end.

use std::path::PathBuf;

use crate::zenoh;
use simd_world::handle::CallError;

/// Error of a daemon's start, or cause of its unexpected end.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// An asset root is not a readable folder.
    #[error("asset root {folder}: {source}", folder = folder.display())]
    AssetRoot {
        /// Folder as the operator wrote it.
        folder: PathBuf,
        /// Error of the system.
        source: std::io::Error,
    },
    /// A folder is missing or takes no file.
    #[error("{key}: {folder}: {source}; make the folder, or name another one", folder = folder.display())]
    Folder {
        /// The key of the configuration that names it.
        key: &'static str,
        /// As the operator wrote it.
        folder: PathBuf,
        /// The system's words.
        source: std::io::Error,
    },
    /// The address or the socket cannot be listened on.
    #[error("cannot listen on {address}: {source}")]
    Listen {
        /// Address as the operator wrote it.
        address: String,
        /// Error of the system.
        source: std::io::Error,
    },
    /// The files of TLS or of tokens are unusable.
    #[error("{0}")]
    Security(String),
    /// Zenoh cannot be served.
    #[error(transparent)]
    Zenoh(#[from] zenoh::Error),
    /// A robot cannot be loaded.
    #[error("cannot load {path}: {source}", path = path.display())]
    Robot {
        /// Path as the operator wrote it.
        path: PathBuf,
        /// Reason.
        source: CallError,
    },
    /// The process may open too few files.
    #[error(
        "the system's limit of open files is {limit}, and the daemon needs {least} without a connection: raise it (ulimit -n, \
         LimitNOFILE)"
    )]
    OpenFiles {
        /// The limit.
        limit: u64,
        /// The lowest limit of a start.
        least: u64,
    },
    /// The system refuses threads or signals.
    #[error("cannot start: {0}")]
    System(std::io::Error),
    /// The driver failed.
    #[error("the physics thread ended: {0}")]
    Driver(String),
    /// The server failed.
    #[error("the server ended: {0}")]
    Server(String),
    /// A second signal came during the drain.
    #[error("cut off by a second signal")]
    CutOff,
}

impl Error {
    /// Returns the process's exit code, as in `simd --help`.
    pub fn exit_code(&self) -> u8 {
        match self {
            // The asset root existed when the configuration was read.
            Self::AssetRoot { .. }
            | Self::OpenFiles { .. }
            | Self::System(_)
            | Self::Driver(_)
            | Self::Server(_)
            | Self::CutOff => 1,
            Self::Listen { .. } => 4,
            Self::Robot { .. } => 5,
            Self::Security(_) | Self::Folder { .. } => 3,
            Self::Zenoh(error) => error.exit_code(),
        }
    }
}
