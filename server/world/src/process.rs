//! What the system and the allocator say of this process. Where they do not say it there is nothing.

use std::fs;
use std::sync::OnceLock;

/// Says how many bytes are allocated, in a program that counts them.
static ALLOCATED: OnceLock<fn() -> usize> = OnceLock::new();

/// Takes the count of a program's allocator; the first one stays.
pub fn count_heap_by(allocated: fn() -> usize) {
    let _ = ALLOCATED.set(allocated);
}

/// Memory that is allocated and not freed, in a program that counts it. It is less than what the process has: an allocator
/// keeps what was freed.
pub fn heap_bytes() -> Option<usize> {
    ALLOCATED.get().map(|allocated| allocated())
}

/// Memory that it has.
pub fn resident_bytes() -> Option<u64> {
    let text = fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    let kilobytes: u64 = line.trim().strip_suffix(" kB")?.trim().parse().ok()?;
    Some(kilobytes.saturating_mul(1024))
}

/// Files, sockets and pipes that are open.
pub fn open_files() -> Option<usize> {
    fs::read_dir("/proc/self/fd").ok().map(Iterator::count)
}
