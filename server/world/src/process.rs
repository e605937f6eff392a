//! Facts about this process from the system and the allocator; `None` if they are unavailable.

use std::fs;
use std::sync::OnceLock;

/// Returns the allocated bytes, in a program that counts them.
static ALLOCATED: OnceLock<fn() -> usize> = OnceLock::new();

/// Sets the counter of a program's allocator; the first one stays.
pub fn count_heap_by(allocated: fn() -> usize) {
    let _ = ALLOCATED.set(allocated);
}

/// Returns the bytes that are allocated and not freed, in a program that counts them. The process has more:
/// an allocator keeps freed memory.
pub fn heap_bytes() -> Option<usize> {
    ALLOCATED.get().map(|allocated| allocated())
}

/// Returns what is allocated, if it is more than seven eighths of the limit: the last eighth is for calls under way. A limit of 0 is
/// none.
pub fn full_heap(limit: u64) -> Option<u64> {
    let allocated = heap_bytes()? as u64;
    (limit > 0 && allocated > limit / 8 * 7).then_some(allocated)
}

/// Memory that it has.
pub fn resident_bytes() -> Option<u64> {
    let text = fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    let kilobytes: u64 = line.trim().strip_suffix(" kB")?.trim().parse().ok()?;
    Some(kilobytes.saturating_mul(1024))
}

/// Returns the number of open files, sockets and pipes.
pub fn open_files() -> Option<usize> {
    fs::read_dir("/proc/self/fd").ok().map(Iterator::count)
}
