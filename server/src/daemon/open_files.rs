//! The system's limit of open files, of which each connection is one.

/// Files that are open beside connections: Zenoh's, those that are read, the runtime's.
const SPARE: u64 = 64;

/// Raises the limit as far as the process may, and warns where it is too low for all connections that are allowed: beyond it
/// no client can connect until others have gone.
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

/// The limit; `None` where there is none.
#[cfg(target_os = "linux")]
fn raised() -> Option<u64> {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
    let limit = getrlimit(Resource::Nofile);
    // Where it cannot be raised it is what it was.
    let _ = setrlimit(Resource::Nofile, Rlimit { current: limit.maximum, maximum: limit.maximum });
    getrlimit(Resource::Nofile).current
}

#[cfg(not(target_os = "linux"))]
fn raised() -> Option<u64> {
    None
}
