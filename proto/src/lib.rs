//! The `simd.v1` schema as Rust types, and what both ends must agree on beside
//! it: versions, the names of headers, tokens, the keys of Zenoh, how a claim is proven there, and which characters of a name
//! are shown.

pub mod access;
pub mod checked;
mod hex;
pub mod keys;
pub mod methods;
pub mod proof;
pub mod raw;
pub mod text;

/// The messages and services of `simd/v1/*.proto`.
#[allow(missing_docs, unreachable_pub, clippy::all, clippy::pedantic)]
#[allow(rustdoc::all)]
pub mod v1 {
    tonic::include_proto!("simd.v1");

    /// The compiled schema, for reflection.
    pub const FILE_DESCRIPTOR_SET: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/simd.v1.bin"));
}

/// The version of the schema: a daemon serves clients of its own major version
/// and of a minor version that is not larger than its own.
pub const API_VERSION: ApiVersion = ApiVersion { major: 1, minor: 0 };

/// The header (gRPC metadata) in which a client says its [`ApiVersion`], as `1.0`.
pub const API_VERSION_HEADER: &str = "simd-api-version";

/// The header (gRPC metadata) in which a client says who it is, for people to read.
pub const CLIENT_HEADER: &str = "simd-client";

/// The line of a Zenoh attachment in which a client says the id of its session, which has a token (see
/// [`keys::client`]): what the call binds to it ends with the session.
pub const SESSION_HEADER: &str = "simd-session";

/// Characters of a client's name; more are cut.
pub const MAX_CLIENT_NAME: usize = 64;

/// The `domain` of every `google.rpc.ErrorInfo` of simd.
pub const ERROR_DOMAIN: &str = "simd";

/// The port that the daemon listens on where nothing else is said.
pub const DEFAULT_PORT: u16 = 7400;

/// A version of the schema.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ApiVersion {
    /// Changes when old clients can no longer be served.
    pub major: u32,
    /// Grows when something is added.
    pub minor: u32,
}

impl ApiVersion {
    /// Reads `MAJOR.MINOR`.
    pub fn parse(text: &str) -> Option<Self> {
        let (major, minor) = text.split_once('.')?;
        Some(Self { major: major.parse().ok()?, minor: minor.parse().ok()? })
    }
}

impl std::fmt::Display for ApiVersion {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}.{}", self.major, self.minor)
    }
}
