//! Resources of this machine for a daemon. Without information from the system, there are no findings.

use std::{
    fs,
    path::{Path, PathBuf},
    thread::available_parallelism,
};

use super::Finding;
use crate::output::number::{count, fixed};

/// Memory of a daemon with a few hundred robots, and its clients' uploads.
const MIN_MEMORY: u64 = 256 << 20;
/// Open files of a daemon: connections, files, and Zenoh's sessions.
const MIN_FILES: u64 = 1_024;

/// Checks all resources.
pub(super) fn look() -> Vec<Finding> {
    let read = |path: &str| fs::read_to_string(path).ok();
    let processors = available_parallelism().map_or(1, std::num::NonZero::get);
    let limits = read("/proc/self/limits").unwrap_or_default();
    let memory = read("/proc/meminfo").and_then(|text| available(&text));
    let group = read("/proc/self/cgroup").and_then(|text| group_limit(Path::new("/sys/fs/cgroup"), &text));
    let governor = read("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor");
    [
        Some(self::processors(processors)),
        read("/proc/loadavg").and_then(|text| load(&text, processors)),
        memory.map(|available| self::memory(available, group, limit(&limits, "Max address space"))),
        limit(&limits, "Max open files").map(open_files),
        limit(&limits, "Max realtime priority").map(real_time),
        governor.map(|name| self::governor(name.trim())),
    ]
    .into_iter()
    .flatten()
    .collect()
}

fn processors(number: usize) -> Finding {
    const CHECK: &str = "processors";
    match number {
        0 | 1 => Finding::warning(
            CHECK,
            "one, which the physics and its clients share",
            "give the daemon two processors or more: calls are answered on others than the one that steps",
        ),
        number => Finding::ok(CHECK, number.to_string()),
    }
}

/// Checks the load, from the text of `/proc/loadavg`.
fn load(text: &str, processors: usize) -> Option<Finding> {
    const CHECK: &str = "load";
    let load: f64 = text.split_whitespace().next()?.parse().ok()?;
    let found = format!("{} over the last minute, on {}", fixed(load, 2), count(processors, "processor"));
    Some(match load > processors as f64 {
        true => Finding::warning(
            CHECK,
            found,
            "end other programs, or reserve processors for the daemon: steps begin late",
        ),
        false => Finding::ok(CHECK, found),
    })
}

/// A limit of the process; the inner `None` is unlimited.
type Limit = Option<u64>;

/// Returns the hard limit of a line of `/proc/self/limits`.
fn limit(limits: &str, name: &str) -> Option<Limit> {
    let rest = limits.lines().find_map(|line| line.strip_prefix(name))?;
    match rest.split_whitespace().nth(1)? {
        "unlimited" => Some(None),
        number => number.parse().ok().map(Some),
    }
}

/// Returns `MemAvailable` of `/proc/meminfo`, in bytes.
fn available(text: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kilobytes.checked_mul(1024)
}

/// Returns the memory limit of the control group and its parents: the least of all. Takes the text of
/// `/proc/self/cgroup`.
fn group_limit(root: &Path, text: &str) -> Option<u64> {
    let group = text.lines().find_map(|line| line.strip_prefix("0::/"))?;
    let group = PathBuf::from(group);
    let folders = group.ancestors().map(|group| root.join(group));
    let limit = |folder: PathBuf| fs::read_to_string(folder.join("memory.max")).ok()?.trim().parse().ok();
    folders.filter_map(limit).min()
}

fn memory(available: u64, group: Option<u64>, address_space: Option<Limit>) -> Finding {
    const CHECK: &str = "memory";
    let mebibytes = |bytes: u64| format!("{} MiB", bytes >> 20);
    let mut found = format!("{} are available", mebibytes(available));
    let limits = [("the control group", group), ("`ulimit -v`", address_space.flatten())];
    for (name, limit) in limits.iter().filter_map(|(name, limit)| Some((name, (*limit)?))) {
        found += &format!("; {name} allows {}", mebibytes(limit));
    }
    let least = limits.iter().filter_map(|(_, limit)| *limit).fold(available, u64::min);
    match least < MIN_MEMORY {
        true => Finding::warning(
            CHECK,
            found,
            format!(
                "free memory or raise the limit: below {} robots and uploads fail",
                mebibytes(MIN_MEMORY)
            ),
        ),
        false => Finding::ok(CHECK, found),
    }
}

fn open_files(limit: Limit) -> Finding {
    const CHECK: &str = "open files";
    match limit {
        Some(limit) if limit < MIN_FILES => Finding::warning(
            CHECK,
            format!("at most {limit}"),
            format!(
                "raise `ulimit -Hn`, or LimitNOFILE= of the service, to {MIN_FILES} or more: connections are files"
            ),
        ),
        Some(limit) => Finding::ok(CHECK, format!("at most {limit}")),
        None => Finding::ok(CHECK, "without limit"),
    }
}

fn real_time(limit: Limit) -> Finding {
    const CHECK: &str = "real-time scheduling";
    match limit {
        Some(0) => Finding::warning(
            CHECK,
            "not allowed to this user (`ulimit -r` is 0)",
            "where steps must not be late, give the service LimitRTPRIO=, as the drop-in realtime.conf does, or \
             CPUSchedulingPolicy=; else leave it",
        ),
        Some(limit) => Finding::ok(CHECK, format!("allowed up to priority {limit}")),
        None => Finding::ok(CHECK, "allowed"),
    }
}

fn governor(name: &str) -> Finding {
    const CHECK: &str = "governor";
    match name {
        "powersave" | "conservative" => Finding::warning(
            CHECK,
            format!("{name}: processors slow down between steps"),
            "`cpupower frequency-set --governor performance` makes steps take equally long",
        ),
        name => Finding::ok(CHECK, name),
    }
}

#[cfg(test)]
mod tests {
    use super::super::Level;
    use super::*;

    const LIMITS: &str = "\
Limit                     Soft Limit           Hard Limit           Units
Max address space         unlimited            unlimited            bytes
Max open files            1024                 524288               files
Max realtime priority     0                    0
";

    #[test]
    fn limits_are_those_of_the_system() {
        assert_eq!(limit(LIMITS, "Max open files"), Some(Some(524_288)));
        assert_eq!(limit(LIMITS, "Max address space"), Some(None));
        assert_eq!(limit(LIMITS, "Max realtime priority"), Some(Some(0)));
        assert_eq!(limit(LIMITS, "Max locked memory"), None);
    }

    #[test]
    fn too_little_of_each_is_a_warning() {
        for (finding, level) in [
            (processors(1), Level::Warning),
            (processors(2), Level::Ok),
            (load("2.01 1.00 1.00 1/2 3\n", 2).unwrap(), Level::Warning),
            (load("2.00 9.00 9.00 1/2 3\n", 2).unwrap(), Level::Ok),
            (open_files(Some(256)), Level::Warning),
            (open_files(Some(4_096)), Level::Ok),
            (open_files(None), Level::Ok),
            (real_time(Some(0)), Level::Warning),
            (real_time(Some(50)), Level::Ok),
            (governor("powersave"), Level::Warning),
            (governor("schedutil"), Level::Ok),
            (memory(1 << 30, None, Some(None)), Level::Ok),
            (memory(1 << 20, None, None), Level::Warning),
            (memory(1 << 30, Some(64 << 20), None), Level::Warning),
            (memory(1 << 30, None, Some(Some(64 << 20))), Level::Warning),
        ] {
            assert_eq!(finding.level, level, "{finding:?}");
            assert_eq!(finding.advice.is_some(), level != Level::Ok, "{finding:?}");
        }
        assert_eq!(load("", 2), None);
        assert_eq!(available("MemTotal: 5 kB\nMemAvailable:    2048 kB\n"), Some(2 << 20));
    }

    #[test]
    fn the_least_limit_of_nested_control_groups_counts() {
        let root = tempfile::tempdir().unwrap();
        let inner = root.path().join("system.slice/simd.service");
        fs::create_dir_all(&inner).unwrap();
        let group = "0::/system.slice/simd.service\n";
        assert_eq!(group_limit(root.path(), group), None);
        fs::write(inner.join("memory.max"), "max\n").unwrap();
        fs::write(root.path().join("system.slice/memory.max"), "1000\n").unwrap();
        assert_eq!(group_limit(root.path(), group), Some(1_000));
        fs::write(inner.join("memory.max"), "900\n").unwrap();
        assert_eq!(group_limit(root.path(), group), Some(900));
    }
}
