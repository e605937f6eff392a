//! The system's limit of open files; each connection is one.

use super::Error;

/// Number of open files other than connections: Zenoh's, files being read, the runtime's.
const SPARE: u64 = 64;
/// Number of open files of each thread that serves connections.
const OF_THREAD: u64 = 4;

/// Raises the limit as far as the process may, and warns if it is too low for all allowed connections. Beyond
/// it, no client can connect until others have disconnected.
///
/// # Errors
/// Returns an error if the limit is too low for the daemon itself.
pub(super) fn provide(connections: usize) -> Result<(), Error> {
    let Some(limit) = raised() else { return Ok(()) };
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let least = SPARE + OF_THREAD * threads as u64;
    if limit < least {
        return Err(Error::OpenFiles { limit, least });
    }
    let wanted = connections as u64 + least;
    if limit < wanted {
        tracing::warn!(
            limit,
            "{connections} connections are allowed, which takes {wanted} open files: raise the system's limit \
             (ulimit -n, LimitNOFILE), or lower `max` of [connections]"
        );
    }
    Ok(())
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
