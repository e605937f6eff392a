//! The system's limit of open files; each connection is one.

/// Number of open files beside connections: Zenoh's, files being read, the runtime's.
const SPARE: u64 = 64;

/// Raises the limit as far as the process may, and warns if it is too low for all allowed connections. Beyond
/// it, no client can connect until others have disconnected.
pub(super) fn provide(connections: usize) {
    let wanted = connections as u64 + SPARE;
    if let Some(limit) = raised().filter(|limit| *limit < wanted) {
        tracing::warn!(
            limit,
            "{connections} connections are allowed, which takes {wanted} open files: raise the system's limit \
             (ulimit -n, LimitNOFILE), or lower `max` of [connections]"
        );
    }
}

/// Raises and returns the limit; `None` for no limit.
#[cfg(target_os = "linux")]
fn raised() -> Option<u64> {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
    let limit = getrlimit(Resource::Nofile);
    // If it cannot be raised, it stays unchanged.
    let _ = setrlimit(Resource::Nofile, Rlimit { current: limit.maximum, maximum: limit.maximum });
    getrlimit(Resource::Nofile).current
}

#[cfg(not(target_os = "linux"))]
fn raised() -> Option<u64> {
    None
}
