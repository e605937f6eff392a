//! What of the kernel decides how late it wakes a thread, whatever the thread's priority: the log of a run says what was measured.

/// A line with the kernel's version, how it preempts, and how many received packets it handles at once.
pub fn kernel() -> String {
    described(|file| std::fs::read_to_string(file).ok())
}

fn described(read: impl Fn(&str) -> Option<String>) -> String {
    let value =
        |file: String| read(&file).map_or_else(|| "unknown".to_owned(), |text| text.trim().to_owned());
    let [release, version] = ["osrelease", "version"].map(|name| value(format!("/proc/sys/kernel/{name}")));
    let line = read("/proc/cmdline").unwrap_or_default();
    let asked = line.split_whitespace().find(|word| word.starts_with("preempt="));
    // Of kernels that can be asked, where debugfs is there: that in brackets holds.
    let offered = read("/sys/kernel/debug/sched/preempt").map(|text| format!("preempt: {}", text.trim()));
    let settings = ["netdev_budget", "netdev_budget_usecs", "dev_weight"]
        .map(|name| format!("net.core.{name} = {}", value(format!("/proc/sys/net/core/{name}"))));
    let parts = [Some(format!("Linux {release} {version}")), asked.map(str::to_owned), offered];
    parts.into_iter().flatten().chain(settings).collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_kernel_does_not_say_is_unknown() {
        let read = |file: &str| {
            let text = match file {
                "/proc/sys/kernel/osrelease" => "6.1.0-13\n",
                "/proc/sys/kernel/version" => "#1 SMP PREEMPT_DYNAMIC\n",
                "/proc/cmdline" => "root=/dev/vda1 preempt=full quiet\n",
                "/proc/sys/net/core/netdev_budget" => "24\n",
                "/proc/sys/net/core/netdev_budget_usecs" => "8000\n",
                _ => return None,
            };
            Some(text.to_owned())
        };
        assert_eq!(
            described(read),
            "Linux 6.1.0-13 #1 SMP PREEMPT_DYNAMIC; preempt=full; net.core.netdev_budget = 24; \
             net.core.netdev_budget_usecs = 8000; net.core.dev_weight = unknown"
        );
        assert!(described(|_| None).starts_with("Linux unknown unknown; net.core.netdev_budget = unknown"));
    }
}
